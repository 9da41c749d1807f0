//! What can go wrong, as data.

/// An input or a computation that has no physical meaning.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number that cannot be as given.
    #[error("{0}")]
    Core(#[from] vpm_core::Error),
    /// A linkage that cannot be closed, or not be solved for its motion.
    #[error("{0}")]
    Linkage(#[from] LinkageError),
}

/// Shorthand for results of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// A closed linkage that has no configuration, or no definite motion, for what was asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinkageError {
    /// The parts do not reach each other.
    #[error(
        "linkage `{linkage}` cannot be assembled at {input} = {value}: its ends are {distance} m apart, but its links \
         reach from {nearest} m to {farthest} m; choose a value nearer to one that can be assembled"
    )]
    Apart {
        /// Name of the linkage.
        linkage: String,
        /// What was given, with its unit.
        input: &'static str,
        /// The value given.
        value: f64,
        /// Distance of the two ends in m.
        distance: f64,
        /// Shortest distance that the links can span, in m.
        nearest: f64,
        /// Longest distance that the links can span, in m.
        farthest: f64,
    },
    /// Newton's method ended without a solution.
    #[error(
        "the constraints of linkage `{linkage}` are still violated by {residual:e} after {iterations} Newton steps \
         (allowed: {tolerance:e}); start nearer to the solution or check that the linkage can be assembled"
    )]
    NotConverged {
        /// Name of the linkage.
        linkage: String,
        /// Newton steps taken.
        iterations: usize,
        /// Largest constraint violation left.
        residual: f64,
        /// Largest violation allowed.
        tolerance: f64,
    },
    /// The constraints do not determine the motion.
    #[error(
        "linkage `{linkage}` is singular at coordinates {coordinates:?}: the smallest pivot of its equations is \
         {pivot:e} of its row's largest entry; move away from the aligned configuration"
    )]
    Singular {
        /// Name of the linkage.
        linkage: String,
        /// Where.
        coordinates: Vec<f64>,
        /// Smallest pivot relative to its row.
        pivot: f64,
    },
}
