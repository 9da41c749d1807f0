//! What can go wrong with drives and their supplies.

/// A drive or a supply that cannot be as described, or that is asked for what it cannot tell.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DriveError {
    /// A drive on something that it cannot act on.
    #[error(
        "actuator `{actuator}` of type {drive} acts on {found}, but it needs {needed}; put it there or give it another type"
    )]
    Target {
        /// Name of the actuator.
        actuator: String,
        /// Type of its drive.
        drive: &'static str,
        /// What it acts on, with the name.
        found: String,
        /// What it can act on.
        needed: &'static str,
    },
    /// A cylinder without states of its pressures behind a valve that shuts quite.
    #[error(
        "actuator `{actuator}` has quasi-static pressures, but a valve without clearance would lock its piston in the middle; give the \
         valve a clearance, or take pressures with states"
    )]
    Clearance {
        /// Name of the actuator.
        actuator: String,
    },
    /// A table of efforts that cannot be one.
    #[error("the table of actuator `{actuator}` {what}; {repair}")]
    Table {
        /// Name of the actuator.
        actuator: String,
        /// What is wrong, with the numbers.
        what: String,
        /// What to do.
        repair: &'static str,
    },
    /// Two parameters whose order has no meaning.
    #[error("`{path}` must be below `{other}` ({limit}), got {value}; {repair}")]
    Order {
        /// Dotted name of the one.
        path: String,
        /// Its value.
        value: f64,
        /// Dotted name of the other.
        other: String,
        /// Its value.
        limit: f64,
        /// What to do.
        repair: &'static str,
    },
    /// A state that the law of its drive or effect never leads to.
    #[error(
        "the {state} starts at {value:.4e}, but its law leads it no further than {reach:.4e} from zero; start within that"
    )]
    Start {
        /// The state in words.
        state: String,
        /// Where it starts.
        value: f64,
        /// How far from zero its law leads at most.
        reach: f64,
    },
    /// A piston that starts outside of its cylinder.
    #[error(
        "the piston of actuator `{actuator}` starts {place:.6} m from mid-stroke, but its stroke ends at -{reach:.6} m and {reach:.6} m; start \
         where {measure} lies between {least:.6} m and {most:.6} m, or correct `retracted_length`"
    )]
    Piston {
        /// Name of the actuator.
        actuator: String,
        /// Place of the piston from mid-stroke, m.
        place: f64,
        /// Half of the stroke, m.
        reach: f64,
        /// What decides the place, for example ``the length of line `strut` ``.
        measure: String,
        /// Its value at the end of chamber a, m.
        least: f64,
        /// Its value at the end of chamber b, m.
        most: f64,
    },
    /// A drive in sampled time where only continuous time will do.
    #[error(
        "actuator `{actuator}` of type {drive} acts at samples of its own and remembers the last ones, so {what}; {repair}"
    )]
    Sampled {
        /// Name of the actuator.
        actuator: String,
        /// Type of its drive.
        drive: &'static str,
        /// What is not possible.
        what: &'static str,
        /// What to do.
        repair: &'static str,
    },
    /// Inverse dynamics with a drive that has a life of its own.
    #[error(
        "the effort of actuator `{actuator}` of type {drive} does not follow from its command alone, so that it cannot be balanced sample \
         by sample; simulate it, in a free run or in restarts from measured states"
    )]
    Effort {
        /// Name of the actuator.
        actuator: String,
        /// Type of its drive.
        drive: &'static str,
    },
}
