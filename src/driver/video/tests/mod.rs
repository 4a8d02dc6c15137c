//! Cameras of image files, and of pipelines that something is written into at the other end.

mod bad_files;
mod files;
mod pipelines;
mod recorded;
mod refusals;
