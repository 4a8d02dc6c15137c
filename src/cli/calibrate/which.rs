//! Which calibration is asked for.

use super::camera::{self, CameraArguments};
use super::compare::{self, CompareArguments};
use super::force::{self, ForceArguments};
use super::import::{self, ImportArguments};
use super::registration::{self, RegistrationArguments};
use super::set::{self, SetArguments};
use super::stage::{self, StageArguments};
use crate::cli::{Context, Outcome};
use clap::Subcommand;

/// What may be calibrated.
#[derive(Debug, Subcommand)]
pub(in crate::cli) enum Calibration {
    Camera(CameraArguments),
    Compare(CompareArguments),
    Force(ForceArguments),
    Import(ImportArguments),
    Registration(RegistrationArguments),
    Set(SetArguments),
    Stage(StageArguments),
}

pub(in crate::cli) fn run(what: &Calibration, context: &Context) -> anyhow::Result<Outcome> {
    match what {
        Calibration::Camera(arguments) => camera::run(arguments, context),
        Calibration::Compare(arguments) => compare::run(arguments, context),
        Calibration::Force(arguments) => force::run(arguments, context),
        Calibration::Import(arguments) => import::run(arguments, context),
        Calibration::Registration(arguments) => registration::run(arguments, context),
        Calibration::Set(arguments) => set::run(arguments, context),
        Calibration::Stage(arguments) => stage::run(arguments, context),
    }
}
