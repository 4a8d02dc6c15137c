//! `calibrate`: reference values and instruments, from what they showed.

mod board_pictures;
mod camera;
mod compare;
mod force;
mod import;
mod instrument;
mod registration;
mod set;
mod stage;
mod which;

pub(super) use which::{Calibration, run};
