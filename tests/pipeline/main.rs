//! Whole paths through the program: data made, estimated from, compared with what made them. One module a topic.

mod diagnose;
mod draws;
mod jacobian;
mod practice;
mod published;
mod published_recording;
mod small;
mod tips;
mod weights;
