//! Where the number of a parameter has a meaning.

/// The values for which a law is defined; anything else is an error before the computation starts.
///
/// It forbids only what has no meaning at all, so that an optimiser may move freely within its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// Every finite number.
    Any,
    /// Greater than zero.
    Positive,
    /// Zero or greater.
    NonNegative,
    /// Anything but zero.
    NonZero,
    /// Greater than zero and at most 1.
    Ratio,
}

impl Domain {
    /// Whether `value` lies in the domain.
    pub fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Any => true,
                Self::Positive => value > 0.0,
                Self::NonNegative => value >= 0.0,
                Self::NonZero => value != 0.0,
                Self::Ratio => value > 0.0 && value <= 1.0,
            }
    }

    /// Condition of a domain in words, after "must".
    pub fn condition(self) -> &'static str {
        match self {
            Self::Any => "be a finite number",
            Self::Positive => "be greater than zero",
            Self::NonNegative => "not be negative",
            Self::NonZero => "not be zero",
            Self::Ratio => "be greater than zero and at most 1",
        }
    }
}
