//! What the phantom does under a load.
