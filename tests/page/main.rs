//! What a fit, a diagnosis and a proof leave behind, from the outside: their files, and their pages in a real browser.

mod browser;
mod diagnosis;
mod files;
mod picture;
mod readings;
mod scorecard;
mod synthetic;
mod view;
