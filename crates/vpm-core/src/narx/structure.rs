//! Which products of which lagged signals a model is made of.

use crate::error::{NarxError, Result};

/// A lagged signal: number 0 is the output, the inputs follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Factor {
    /// 0 for the output, 1, 2, ... for the inputs.
    pub signal: usize,
    /// How many samples ago.
    pub delay: usize,
}

/// A product of factors, sorted; without any it is the constant 1.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Term {
    factors: Vec<Factor>,
}

impl Term {
    /// Term of a structure: the product of these factors, in any order.
    pub fn new(mut factors: Vec<Factor>) -> Self {
        factors.sort_unstable();
        Self { factors }
    }

    /// Factors of a structure's term, sorted.
    pub fn factors(&self) -> &[Factor] {
        &self.factors
    }

    /// Text of a structure's term, with names of output and inputs: `force[k-1]^2*u[k]`.
    pub fn text(&self, signals: &[String]) -> String {
        let lagged = |factor: &Factor| {
            let unknown = format!("signal {}", factor.signal);
            let name = signals.get(factor.signal).unwrap_or(&unknown);
            match factor.delay {
                0 => format!("{name}[k]"),
                delay => format!("{name}[k-{delay}]"),
            }
        };
        let powers = self.factors.chunk_by(|a, b| a == b).map(|same| match same.len() {
            1 => lagged(&same[0]),
            power => format!("{}^{power}", lagged(&same[0])),
        });
        if self.factors.is_empty() { "1".to_owned() } else { powers.collect::<Vec<_>>().join("*") }
    }
}

/// The terms of a model and the names of its signals.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    signals: Vec<String>,
    terms: Vec<Term>,
    longest: usize,
}

impl Structure {
    /// Structure of terms over `signals`, the output's name first.
    ///
    /// # Errors
    ///
    /// A term twice, of a signal that is not there, or of the output itself at the sample that is computed.
    pub fn new(signals: &[String], terms: Vec<Term>) -> Result<Self> {
        for (at, term) in terms.iter().enumerate() {
            let wrong = |reason: String, repair| NarxError::Factor { term: term.text(signals), reason, repair };
            if let Some(factor) = term.factors.iter().find(|factor| factor.signal >= signals.len()) {
                let reason = format!("names signal {}, but there are {}", factor.signal, signals.len());
                return Err(wrong(reason, "number the output 0 and the inputs from 1").into());
            }
            if term.factors.iter().any(|factor| factor.signal == 0 && factor.delay == 0) {
                let reason = "contains the output that it is to compute".to_owned();
                return Err(wrong(reason, "let lags of the output begin at 1").into());
            }
            if terms[..at].contains(term) {
                return Err(wrong("is there twice".to_owned(), "leave one of them out").into());
            }
        }
        let longest = terms.iter().flat_map(Term::factors).map(|factor| factor.delay).max().unwrap_or(0);
        Ok(Self { signals: signals.to_vec(), terms, longest })
    }

    /// Names of a structure's output and inputs.
    pub fn signals(&self) -> &[String] {
        &self.signals
    }

    /// Number of a structure's inputs.
    pub fn inputs(&self) -> usize {
        self.signals.len() - 1
    }

    /// Terms of a structure.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// Longest lag of a structure in samples: how many samples a simulation needs before its first.
    pub fn longest_lag(&self) -> usize {
        self.longest
    }

    /// Structure of the first `count` terms alone.
    pub fn first(&self, count: usize) -> Result<Self> {
        Self::new(&self.signals, self.terms.iter().take(count).cloned().collect())
    }
}

/// Lags of one signal from which candidates are formed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lags {
    /// 0 for the output, 1, 2, ... for the inputs.
    pub signal: usize,
    /// The lags in samples.
    pub delays: Vec<usize>,
}

/// Candidate terms of a structure: all products of at most `degree` lagged signals. Lower degrees come first, the
/// constant term in front of them if asked.
pub fn candidates(lags: &[Lags], degree: usize, constant: bool) -> Vec<Term> {
    let single: Vec<Factor> =
        lags.iter().flat_map(|lags| lags.delays.iter().map(|&delay| Factor { signal: lags.signal, delay })).collect();
    let mut found = if constant { vec![Term::default()] } else { Vec::new() };
    let mut last: Vec<(usize, Vec<Factor>)> = vec![(0, Vec::new())];
    for _ in 0..degree {
        last = last
            .iter()
            .flat_map(|(from, factors)| (*from..single.len()).map(|at| (at, [factors, &single[at..=at]].concat())))
            .collect();
        found.extend(last.iter().map(|(_, factors)| Term::new(factors.clone())));
    }
    found
}
