//! What a fit leaves behind, from the outside: the files of `write_fit` and the page in a real browser.

mod browser;
mod files;
mod picture;
mod synthetic;
mod view;
