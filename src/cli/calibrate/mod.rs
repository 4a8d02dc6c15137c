//! `calibrate`: reference values and instruments, from what they showed.

mod board_pictures;
mod camera;
mod import;
mod registration;
mod which;

pub(super) use which::{Calibration, run};
