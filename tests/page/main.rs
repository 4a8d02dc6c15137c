//! What a fit, a diagnosis and a proof leave behind, from the outside: their files, and their pages in a real browser.

#[path = "../calibration/bench.rs"]
mod bench;
mod browser;
mod diagnosis;
mod files;
mod instruments;
mod picture;
#[path = "../support/program.rs"]
mod program;
mod readings;
mod scorecard;
mod synthetic;
mod view;
