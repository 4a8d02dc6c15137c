//! Which calibration is asked for.

use super::bands::{self, BandsArguments};
use super::camera::{self, CameraArguments};
use super::compare::{self, CompareArguments};
use super::force::{self, ForceArguments};
use super::import::{self, ImportArguments};
use super::registration::{self, RegistrationArguments};
use super::relaxation::{self, RelaxationArguments};
use super::set::{self, SetArguments};
use super::stage::{self, StageArguments};
use super::tensile::{self, TensileArguments};
use crate::cli::{Context, Outcome};
use clap::Subcommand;

/// What may be calibrated.
#[derive(Debug, Subcommand)]
pub(in crate::cli) enum Calibration {
    Bands(BandsArguments),
    Camera(CameraArguments),
    Compare(CompareArguments),
    Force(ForceArguments),
    Import(ImportArguments),
    Registration(RegistrationArguments),
    Relaxation(RelaxationArguments),
    Set(SetArguments),
    Stage(StageArguments),
    Tensile(TensileArguments),
}

pub(in crate::cli) fn run(what: &Calibration, context: &Context) -> anyhow::Result<Outcome> {
    match what {
        Calibration::Bands(arguments) => bands::run(arguments, context),
        Calibration::Camera(arguments) => camera::run(arguments, context),
        Calibration::Compare(arguments) => compare::run(arguments, context),
        Calibration::Force(arguments) => force::run(arguments, context),
        Calibration::Import(arguments) => import::run(arguments, context),
        Calibration::Registration(arguments) => registration::run(arguments, context),
        Calibration::Relaxation(arguments) => relaxation::run(arguments, context),
        Calibration::Set(arguments) => set::run(arguments, context),
        Calibration::Stage(arguments) => stage::run(arguments, context),
        Calibration::Tensile(arguments) => tensile::run(arguments, context),
    }
}
