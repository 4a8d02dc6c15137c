//! The pictures against closed forms and brute force: dots and depth, and whole frames.

mod dots;
mod frames;
mod stage;
