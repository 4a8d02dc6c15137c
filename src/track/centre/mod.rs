//! Where exactly a dot is: sub-pixel centre, covariance and shape of something that may be a dot.

mod fit;
mod model;
mod moment;
mod refiner;
mod window;

#[cfg(test)]
mod accuracy;

pub(super) use refiner::{Refiner, Rough};
