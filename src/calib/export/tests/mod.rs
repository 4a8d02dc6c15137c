//! Whole exports, from bytes to SI.

mod bad_input;
mod dialects;
mod fuzz;
mod layouts;
mod published;
mod text;

use super::*;
use std::path::Path;
use text::{read, read_with};
