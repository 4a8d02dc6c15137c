//! Whole paths through the program: data made, estimated from, compared with what made them.

mod published;
