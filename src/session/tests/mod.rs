//! Does a session come back as it was written: whole, killed, damaged, on a full disk, replayed, as tables, picture by picture.

mod damage;
mod disk;
pub(crate) mod fixtures;
mod frame;
mod kill;
mod pictures;
mod replay;
mod round_trip;
