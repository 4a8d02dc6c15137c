//! The simulated bench at the level of bytes: what a controller or a sensor would put on the wire.
//!
//! Nothing here shares code with the drivers that it talks to but the tables of `firmware_proto`; each emulator is written from the
//! published interface. None knows what physics is behind it: a stage tells where its tip is, a sensor asks for a wrench.

mod net_ft;
pub use net_ft::{
    NetFtEmulator, NetFtFamily, NetFtFaultSwitch, NetFtFaults, NetFtPageFault, NetFtSetup, PageUnit,
};

mod grbl;
mod serial;
pub use grbl::{GrblDialect, GrblEmulator, GrblFaults, GrblMachine, GrblSetup};

mod native;
pub use native::{
    NativeStageEmulator, NativeStageFaultSwitch, NativeStageFaults, NativeStageSetup, NativeStageTruth,
};
