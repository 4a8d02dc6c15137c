//! What a stage controller run by Grbl 1.1 or grblHAL puts on the wire, and where its axes go.
//!
//! [`GrblMachine`] is the controller without input, output or clock; [`GrblEmulator`] runs one behind a pseudo-terminal.
//! `setup` says which machine it is, `words` what a jog asks for, `profile` how a motion goes, `homing` and `report` what their names
//! say, `faults` what goes wrong on the way.
//!
//! How the two dialects differ here:
//!
//! | | Grbl | grblHAL |
//! | --- | --- | --- |
//! | 0x85 while a jog is unread | ignored: the jog runs | drops the jog, which gets no reply |
//! | 0x84 while jogging | rests as `Door:0`; a reset keeps the position | rests, says `Jog`; a reset is alarm 3 |
//! | after a limit alarm | says nothing until reset | answers; `$X` and `$H` are error 79 until reset |
//! | jog outside the travel, not homed | error 15 | runs |
//! | not homed | locked at power-up; `$X` unlocks | `ALARM:11` after each reset; `$X` is error 46 |
//! | while homing | says nothing | one report at the beginning |
//! | unread bytes, planned motions | 128, 15 | 1024, 100 |
//!
//! What is said of 0x84, of `$X` before homing and of silence while homing was seen on grblHAL's own simulator (build 20260817) and on
//! Grbl 1.1h in grbl-sim; the limit alarm and the jog before homing on grblHAL are from observation by others, the rest from the
//! documentation and the firmwares' sources.

mod emulator;
mod faults;
mod homing;
mod machine;
mod profile;
mod report;
mod setup;
#[cfg(test)]
mod verification;
mod words;

pub use emulator::GrblEmulator;
pub use faults::GrblFaults;
pub use machine::GrblMachine;
pub use setup::{GrblDialect, GrblSetup};
