//! Bundles: the practice recordings read and survive being written, every refusal names its place, and no
//! mesh file crashes a parser.

mod fixture;
mod mesh_writers;
mod meshes;
mod practice;
mod refusals;
mod round_trip;
