//! What can go wrong with NARX models and the records they come from.

/// A NARX model that cannot be as described, or records that cannot tell it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NarxError {
    /// A factor that is not there when the output is computed, or of a signal that is not there at all.
    #[error("term `{term}` {reason}; {repair}")]
    Factor {
        /// The term as it is written.
        term: String,
        /// What is wrong with it.
        reason: String,
        /// What to do.
        repair: &'static str,
    },
    /// A number of something that does not fit the model.
    #[error("{what} {found}, but the model {needed}; {repair}")]
    Count {
        /// What was counted, with its place.
        what: String,
        /// How many there are.
        found: String,
        /// What the model has or needs.
        needed: String,
        /// What to do.
        repair: &'static str,
    },
    /// A record that ends before its lags begin.
    #[error(
        "record `{record}` has {samples} samples, but a model that looks back {lag} samples needs at least {least}; give a longer \
         record or shorter lags"
    )]
    Short {
        /// Name of the record.
        record: String,
        /// Its samples.
        samples: usize,
        /// Longest lag.
        lag: usize,
        /// Samples needed.
        least: usize,
    },
    /// Fewer equations than unknowns.
    #[error(
        "the records give {equations} equations for {terms} parameters, after {lag} samples at the start of each were spent on lags; \
         give more samples or fewer terms"
    )]
    TooFew {
        /// Samples after the lags, of all records.
        equations: usize,
        /// Parameters asked for.
        terms: usize,
        /// Longest lag.
        lag: usize,
    },
    /// A sample that is no number.
    #[error("`{channel}` of record `{record}` is {value} at sample {sample}; repair or cut the record there")]
    NotFinite {
        /// Name of the record.
        record: String,
        /// Name of the channel.
        channel: String,
        /// Sample, from 0.
        sample: usize,
        /// What stands there.
        value: f64,
    },
    /// A channel that never moves.
    #[error(
        "`{channel}` has the value {value} in every sample of every record, so that its terms cannot be told from the constant term; \
         leave it out or give a record in which it moves"
    )]
    Constant {
        /// Name of the channel.
        channel: String,
        /// Its value.
        value: f64,
    },
    /// A regressor that the others already span.
    #[error(
        "term `{term}` is a linear combination of {others} within rounding in these records (what is its own is {own:.1e} of it), so \
         that its coefficient is not determined; leave one of them out or give records that excite them apart"
    )]
    Collinear {
        /// The term.
        term: String,
        /// Those that span it, written out.
        others: String,
        /// Part of the regressor that is orthogonal to the others, relative to its length.
        own: f64,
    },
    /// An output that is zero throughout, or no candidates at all.
    #[error("no term can be selected: {reason}; {repair}")]
    Nothing {
        /// Why.
        reason: String,
        /// What to do.
        repair: &'static str,
    },
    /// A free run that left the range in which the model means something.
    #[error(
        "the free run on record `{record}` diverged at sample {sample}, where `{output}` is {value:e} and the limit {limit:e}; \
         take fewer terms or a lower degree, or start where the model was identified"
    )]
    Diverged {
        /// Name of the record.
        record: String,
        /// Name of the output.
        output: String,
        /// First sample beyond the limit, from 0.
        sample: usize,
        /// The value there.
        value: f64,
        /// Largest magnitude allowed.
        limit: f64,
        /// Output of the samples before.
        samples: Vec<f64>,
    },
}
