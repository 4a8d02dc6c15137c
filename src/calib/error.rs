//! Why a calibration has no answer.

/// Why something could not be calibrated. Lengths in metres, times in seconds.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibError {
    /// Fewer points than the unknowns need.
    #[error("{found} {what}; at least {needed} are needed")]
    TooFew {
        /// Of what.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many it takes.
        needed: usize,
    },
    /// Points that leave a direction open.
    #[error(
        "the {what} lie within {:.2} mm of one line: a turn about it cannot be told", 1e3 * spread_m
    )]
    OnALine {
        /// Which points.
        what: &'static str,
        /// How far they come off the line (m, root mean square).
        spread_m: f64,
    },
    /// A covariance or a place that is not finite, or no variance at all.
    #[error("{what} {index} has a place or a covariance that makes no sense")]
    NotAPoint {
        /// Which points.
        what: &'static str,
        /// Which of them, from 0.
        index: usize,
    },
    /// A point that the others contradict.
    #[error(
        "point {index} is {:.2} mm from where the others put it, {sigmas:.0} standard deviations: a wrong match, or it was moved",
        1e3 * distance_m
    )]
    Outlier {
        /// Which point, from 0.
        index: usize,
        /// How far off (m).
        distance_m: f64,
        /// The same over its standard deviation.
        sigmas: f64,
    },
    /// The known points are not among the seen ones.
    #[error(
        "{found} of the {known} known points are among the {seen} seen ones; at least {needed} are needed"
    )]
    NoMatch {
        /// Matched at best.
        found: usize,
        /// Known points.
        known: usize,
        /// Points that were seen.
        seen: usize,
        /// How many it takes.
        needed: usize,
    },
    /// The known points lie among the seen ones in more than one way.
    #[error(
        "the known points lie among the seen ones in two ways, with {best} and {second} matches: \
         they need an arrangement without symmetry"
    )]
    Ambiguous {
        /// Matches of the best.
        best: usize,
        /// Matches of another one.
        second: usize,
    },
    /// A file that holds no calibration.
    #[error("{why}")]
    File {
        /// What is wrong with it.
        why: String,
    },
    /// Signals that say nothing of each other.
    #[error("{what}")]
    Silent {
        /// Why not.
        what: &'static str,
    },
}
