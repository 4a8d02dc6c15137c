//! What can be wrong with a material or with the deformation that it is asked to bear.

/// Why a law gives no stress.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MaterialError {
    /// Young's modulus that is not a positive number.
    #[error("Young's modulus is {young_pa} Pa; expected a finite number above 0")]
    YoungModulus {
        /// What was given (Pa).
        young_pa: f64,
    },
    /// Poisson's ratio outside the range of a stable compressible solid.
    #[error("Poisson's ratio is {poisson}; expected more than -1 and less than 0.5")]
    PoissonRatio {
        /// What was given (–).
        poisson: f64,
    },
    /// A stiffening that is not a number.
    #[error("the stiffening is {stiffening}; expected a finite number")]
    Stiffening {
        /// What was given (–).
        stiffening: f64,
    },
    /// A deformation that turns the material inside out, or a gradient that is not a number.
    #[error("the volume ratio J is {jacobian}: the material is inverted or flat; expected more than 0")]
    Inverted {
        /// J = det F (–).
        jacobian: f64,
    },
    /// A deformation at which the law's exponential leaves the range of floating point.
    #[error("the exponent of the Fung law is {exponent}; beyond {limit} its energy is not a number any more")]
    Overstretched {
        /// b (Ī₁ − 3) (–).
        exponent: f64,
        /// The largest exponent that is evaluated.
        limit: f64,
    },
}
