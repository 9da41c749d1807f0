//! Drives in sampled time: difference equations with instants of their own, their effort held from each to the next.
//!
//! Here is what a description says of them; they have no state that an integrator knows, and run beside it at the samples.

use serde::Deserialize;

/// What an input of a sampled drive reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reading {
    /// The drive's own command after delay, dead zone and saturation.
    Command,
    /// Coordinate of the joint of that number, m or rad.
    Position(usize),
    /// Velocity of the joint of that number, m/s or rad/s.
    Velocity(usize),
    /// Length of the line of that number, m.
    Length(usize),
    /// How fast the line of that number grows, m/s.
    Rate(usize),
}

/// A polynomial NARX model whose output is the effort.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NarxDrive {
    /// Time between its samples, s.
    pub sample_time: f64,
    /// Name of each input, and what it reads.
    pub inputs: Vec<(String, Reading)>,
    /// Factors of each term: signal (0 the effort, then the inputs) and lag in samples.
    pub terms: Vec<Vec<(usize, usize)>>,
    /// One number per term, SI.
    pub coefficients: Vec<f64>,
    /// Largest effort that counts as the model's, N or N m.
    #[serde(default)]
    pub limit: Option<f64>,
    /// Effort before the first sample, N or N m.
    #[serde(default)]
    pub initial: f64,
}

/// A Maxwell element beside a spring in sampled time, along a line or a coordinate; it pulls where it is longer than at rest.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaxwellNarxDrive {
    /// Time between its samples, s.
    pub sample_time: f64,
    /// Coefficients of k0 (N/m) over `1, u, s, u^2, u s, s^2, u^3, u^2 s, u s^2, s^3` of command and length.
    pub k0: [f64; 10],
    /// Likewise of s0, m.
    pub s0: [f64; 10],
    /// Stiffness in a row with the damper, N/m.
    pub k1: f64,
    /// Its damper, N s/m.
    pub c1: f64,
    /// Name of the difference equation: trapezoidal, printed or central_mean.
    pub scheme: Scheme,
    /// Largest force that counts as the element's, N.
    #[serde(default)]
    pub limit: Option<f64>,
}

/// Which difference equation stands for the differential one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// Of second order.
    Trapezoidal,
    /// As printed, of first order.
    Printed,
    /// The printed one with means, of second order.
    CentralMean,
}
