//! What the phantom does under a load.

pub mod material;
