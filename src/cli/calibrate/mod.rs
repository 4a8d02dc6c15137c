//! `calibrate`: reference values and instruments, from what they showed.

mod bands;
mod board_pictures;
mod camera;
mod compare;
mod force;
mod import;
mod instrument;
mod registration;
mod relaxation;
mod set;
mod specimen;
mod stage;
mod tensile;
mod which;

pub(super) use which::{Calibration, run};
