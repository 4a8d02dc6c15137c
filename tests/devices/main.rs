//! Drivers against emulated devices, at the level of bytes: what works, and every fault that is known from practice.

mod grbl;
mod native_stage;
mod net_ft;
mod net_ft_measure;
mod net_ft_wire;
mod run;
#[path = "../support/run_bench.rs"]
mod run_bench;
#[path = "../support/steady.rs"]
mod steady;
