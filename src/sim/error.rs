//! What can go wrong on the bench.

/// Why the bench gave no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimError {
    /// A block that cannot be meshed.
    #[error(
        "a block of {size_m:?} m with its glue ending at x = {glue_end_m} m cannot be cut into cells of \
         {cell_m} m: lengths must be positive and the glue must end inside the block"
    )]
    BadBlock {
        /// Edge lengths (m).
        size_m: [f64; 3],
        /// Where the glue ends (m).
        glue_end_m: f64,
        /// Wanted cell (m).
        cell_m: f64,
    },
    /// A disc whose centre does not lie in the surface of the block.
    #[error(
        "the {what} at ({}) mm lies {:.3} mm {} the surface of the simulated block, which is flat and known: name a place on it",
        centre_m.map(|m| format!("{:.3}", 1e3 * m)).join(", "), 1e3 * above_m.abs(), if *above_m > 0.0 { "above" } else { "below" }
    )]
    DiscBesideSurface {
        /// Tip, patch or spot.
        what: &'static str,
        /// Its centre (m).
        centre_m: [f64; 3],
        /// Height over the side that it faces (m).
        above_m: f64,
    },
    /// A disc that is not wholly on one side of the block.
    #[error(
        "the {what} at {centre_m:?} m with radius {radius_m} m does not lie wholly on one side of the block of \
         {size_m:?} m"
    )]
    DiscOffSurface {
        /// Tip, patch or spot.
        what: &'static str,
        /// Its centre (m).
        centre_m: [f64; 3],
        /// Its radius (m).
        radius_m: f64,
        /// The block (m).
        size_m: [f64; 3],
    },
    /// Poisson's ratio outside what a compressible material can have.
    #[error("Poisson's ratio is {value}; expected more than −1 and less than 0.5")]
    PoissonRatio {
        /// What was given.
        value: f64,
    },
    /// A poke without depth, speed or time.
    #[error("poke {number}: {what} is {value}; expected more than 0")]
    BadPoke {
        /// Number of the poke.
        number: u32,
        /// Which of its figures.
        what: &'static str,
        /// What was given (SI).
        value: f64,
    },
    /// The supports leave a direct combination of tip and restraints without stiffness.
    #[error("the compliance of {supports} supports is not positive definite: do two discs coincide?")]
    SingularSupports {
        /// Number of support functions.
        supports: usize,
    },
    /// Finite strain: no equilibrium was found.
    #[error(
        "no equilibrium beyond {reached_m:.6} m of {wanted_m:.6} m: the step was cut to {step_m:e} m and the \
         residual is still {residual:e} of the tip force after {iterations} iterations"
    )]
    NoEquilibrium {
        /// Depth of the last equilibrium (m).
        reached_m: f64,
        /// Depth asked for (m).
        wanted_m: f64,
        /// Smallest step tried (m).
        step_m: f64,
        /// Relative residual at the end of the last attempt.
        residual: f64,
        /// Newton iterations in the last attempt.
        iterations: usize,
    },
    /// A session names a place that its phantom does not have.
    #[error("{what} {index} does not exist: the phantom has {count}, counted from 0")]
    NoSuchPlace {
        /// Site, patch or spot.
        what: &'static str,
        /// What was asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A poke at a place that is on no side of the block, or steeper than 45° to it.
    #[error(
        "a poke at {site_m:?} m along {direction:?} enters no side of the block of {size_m:?} m within 45° of its normal"
    )]
    OffSide {
        /// Where (m).
        site_m: [f64; 3],
        /// Unit vector of the poke.
        direction: [f64; 3],
        /// The block (m).
        size_m: [f64; 3],
    },
    /// A poke as deep as the phantom is thick.
    #[error(
        "a poke {depth_m} m deep at {site_m:?} m would come out of a phantom that is {through_m} m thick there"
    )]
    TooDeep {
        /// Where (m).
        site_m: [f64; 3],
        /// Its depth (m).
        depth_m: f64,
        /// From its side to the opposite one (m).
        through_m: f64,
    },
    /// A session was to be recorded on a phantom that was made from another plan.
    #[error("session {session} is to be recorded on another phantom than its own")]
    OtherPhantom {
        /// Name of the session.
        session: String,
    },
    /// An effect with a figure that means nothing.
    #[error("{effect}: {what} is {value}; expected {expected}")]
    BadEffect {
        /// Which effect.
        effect: &'static str,
        /// Which of its figures.
        what: &'static str,
        /// What was given (SI).
        value: f64,
        /// What can be.
        expected: &'static str,
    },
    /// Two effects that the bench cannot have act together.
    #[error("{one} and {other} together are beyond this bench")]
    NotTogether {
        /// One of them.
        one: &'static str,
        /// The other.
        other: &'static str,
    },
    /// The laws of tip and holds have no common solution that Newton's method finds.
    #[error(
        "at {time_s} s tip and holds disagree by {residual_n:e} N after {iterations} iterations of Newton's method"
    )]
    HoldsDisagree {
        /// When (s).
        time_s: f64,
        /// Largest imbalance (N).
        residual_n: f64,
        /// Iterations.
        iterations: usize,
    },
    /// The linear system could not be factored or solved.
    #[error("solving the bench's equations failed")]
    Solve(#[from] crate::sparse::SparseError),
    /// The fit's mesh could not be made.
    #[error("cutting the fit's mesh failed")]
    FitMesh(#[from] crate::mesh::MeshError),
}
