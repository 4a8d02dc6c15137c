//! Which calibration is asked for.

use super::camera::{self, CameraArguments};
use super::import::{self, ImportArguments};
use super::registration::{self, RegistrationArguments};
use crate::cli::{Context, Outcome};
use clap::Subcommand;

/// What may be calibrated.
#[derive(Debug, Subcommand)]
pub(in crate::cli) enum Calibration {
    Camera(CameraArguments),
    Import(ImportArguments),
    Registration(RegistrationArguments),
}

pub(in crate::cli) fn run(what: &Calibration, context: &Context) -> anyhow::Result<Outcome> {
    match what {
        Calibration::Camera(arguments) => camera::run(arguments, context),
        Calibration::Import(arguments) => import::run(arguments, context),
        Calibration::Registration(arguments) => registration::run(arguments, context),
    }
}
