//! The Maxwell element as a difference equation against its closed form: errors, orders, the interleaved sequences, maps.

use std::f64::consts::PI;

use vpm_core::Result;
use vpm_core::narx::{Factor, MaxwellNarx, MaxwellScheme, Narx, Record, Structure, Surface, Term};

const K0: f64 = 1e5;
const S0: f64 = 0.30;
const K1: f64 = 5e5;
const C1: f64 = 2e3;
const TAU: f64 = C1 / K1;
const W: f64 = 2.0 * PI * 1.5;

fn length(t: f64) -> f64 {
    0.32 + 0.01 * (W * t).sin()
}

/// Steady force: the transfer function `(k0 + i w tau (k0 + k1)) / (1 + i w tau)` on the sine.
fn exact(t: f64) -> f64 {
    let (x, rise) = (W * TAU, W * TAU * (K0 + K1));
    let (real, imaginary) = ((K0 + x * rise) / (1.0 + x * x), (rise - x * K0) / (1.0 + x * x));
    K0 * (0.32 - S0) + 0.01 * (real * (W * t).sin() + imaginary * (W * t).cos())
}

fn element(h: f64, scheme: MaxwellScheme) -> Result<MaxwellNarx> {
    MaxwellNarx::new(Surface::constant(K0), Surface::constant(S0), K1, C1, h, scheme)
}

/// Forces over one second at the samples `k h`.
fn run(h: f64, scheme: MaxwellScheme, start: [f64; 2]) -> Result<Vec<f64>> {
    let lengths: Vec<f64> = (0..=(1.0 / h).round() as usize).map(|k| length(k as f64 * h)).collect();
    element(h, scheme)?.simulate_free_run(start, &vec![0.0; lengths.len()], &lengths, 1e6)
}

fn largest_errors(scheme: MaxwellScheme) -> Result<[f64; 4]> {
    let mut errors = [0.0; 4];
    for (error, h) in errors.iter_mut().zip([2e-3, 1e-3, 5e-4, 2.5e-4]) {
        let forces = run(h, scheme, [exact(0.0), exact(h)])?;
        *error = forces.iter().enumerate().fold(0.0, |most, (k, f)| f64::max(most, (f - exact(k as f64 * h)).abs()));
    }
    Ok(errors)
}

#[test]
fn closed_form_is_that_of_the_differential_equation() {
    for (t, force) in [(0.5, 992.9039699), (1.0, 1811.771955), (2.0, 2188.228045)] {
        assert!((exact(t) / force - 1.0).abs() < 1e-9, "{}", exact(t));
        let h = 1e-5;
        let slope = (exact(t + h) - exact(t - h)) / (2.0 * h);
        let rate = (length(t + h) - length(t - h)) / (2.0 * h);
        let balance = exact(t) + TAU * slope - K0 * (length(t) - S0) - TAU * (K0 + K1) * rate;
        assert!(balance.abs() < 1e-4, "{balance}");
    }
}

#[test]
fn errors_are_those_of_the_reference() -> Result<()> {
    let expected = [
        (MaxwellScheme::Printed, [19.81608417, 9.904262424, 4.951163489, 2.475338606]),
        (MaxwellScheme::Trapezoidal, [0.005573298018, 0.001393307901, 0.0003483259161, 8.708140149e-05]),
        (MaxwellScheme::CentralMean, [0.1797787378, 0.04493970384, 0.01123462547, 0.002808636917]),
    ];
    for (scheme, expected) in expected {
        for (error, expected) in largest_errors(scheme)?.into_iter().zip(expected) {
            assert!((error / expected - 1.0).abs() < 1e-3, "{scheme:?}: {error} for {expected}");
        }
    }
    Ok(())
}

#[test]
fn trapezoidal_is_of_second_order_and_printed_of_first() -> Result<()> {
    for (scheme, order) in [(MaxwellScheme::Trapezoidal, 2.0), (MaxwellScheme::Printed, 1.0)] {
        let errors = largest_errors(scheme)?;
        assert!(errors.windows(2).all(|pair| ((pair[0] / pair[1]).log2() - order).abs() < 0.01), "{errors:?}");
    }
    Ok(())
}

#[test]
fn start_errors_of_the_printed_form_fade_as_two_sequences() -> Result<()> {
    let h = 1e-3;
    let right = run(h, MaxwellScheme::Printed, [exact(0.0), exact(h)])?;
    let wrong = run(h, MaxwellScheme::Printed, [exact(0.0), exact(h) + 100.0])?;
    let x = TAU / (2.0 * h);
    assert!(((x / (1.0 + x)).sqrt() - 0.8164965809).abs() < 1e-9);
    for k in 1..20 {
        let expected = if k % 2 == 1 { 100.0 * (x / (1.0 + x)).powi((k as i32 - 1) / 2) } else { 0.0 };
        assert!((wrong[k] - right[k] - expected).abs() < 1e-9, "sample {k}");
    }
    Ok(())
}

/// `F' = F_{k-1} + 2 h / tau (k0 (s_k - s0) + tau (k0 + k1)(s' - s_{k-1}) / (2 h) - F_k)`: the present force in place of the new one.
#[test]
fn explicit_variant_diverges_as_a_polynomial_model() -> Result<()> {
    let h = 1e-3;
    let g = 2.0 * h / TAU;
    let terms: [(Vec<Factor>, f64); 6] = [
        (vec![], -g * K0 * S0),
        (vec![Factor { signal: 0, delay: 1 }], -g),
        (vec![Factor { signal: 0, delay: 2 }], 1.0),
        (vec![Factor { signal: 1, delay: 0 }], K0 + K1),
        (vec![Factor { signal: 1, delay: 1 }], g * K0),
        (vec![Factor { signal: 1, delay: 2 }], -(K0 + K1)),
    ];
    let (terms, theta): (Vec<_>, Vec<_>) =
        terms.map(|(factors, value)| (Term::new(factors), value)).into_iter().unzip();
    let model = Narx::new(Structure::new(&["F".to_owned(), "s".to_owned()], terms)?, &theta)?;
    let lengths: Vec<f64> = (0..1001).map(|k| length(f64::from(k) * h)).collect();
    let mut output = vec![0.0; 1001];
    (output[0], output[1]) = (exact(0.0), exact(h) + 1e-6);
    let run = model.simulate_free_run(&Record { name: "sine", output: &output, inputs: &lengths }, 1e6);
    assert!(run.err().is_some_and(|error| error.to_string().contains("diverged")));
    Ok(())
}

#[test]
fn maps_of_signal_and_length_are_polynomials_of_degree_three() -> Result<()> {
    let surface = Surface(std::array::from_fn(|at| at as f64 + 1.0));
    let (u, s) = (0.7_f64, -1.3_f64);
    let terms = [1.0, u, s, u * u, u * s, s * s, u.powi(3), u * u * s, u * s * s, s.powi(3)];
    let expected: f64 = terms.iter().zip(surface.0).map(|(term, value)| term * value).sum();
    assert!((surface.at(u, s) - expected).abs() < 1e-12);
    // At rest the force is that of the spring, whatever the scheme.
    for scheme in [MaxwellScheme::Trapezoidal, MaxwellScheme::Printed, MaxwellScheme::CentralMean] {
        let still = MaxwellNarx::new(surface, Surface::constant(0.2), 10.0, 0.5, 0.01, scheme)?;
        let forces = still.simulate_free_run([0.0; 2], &[u; 400], &[s; 400], 1e6)?;
        assert!((forces[399] - surface.at(u, s) * (s - 0.2)).abs() < 1e-9, "{scheme:?}: {}", forces[399]);
    }
    Ok(())
}

#[test]
fn impossible_elements_are_refused() {
    let of = |k1: f64, h: f64| {
        let (k0, s0) = (Surface::constant(1.0), Surface::constant(0.0));
        MaxwellNarx::new(k0, s0, k1, 1.0, h, MaxwellScheme::default()).err().map(|error| error.to_string())
    };
    assert!(of(-1.0, 1e-3).is_some_and(|text| text.contains("c1 / k1") && text.contains("-1")));
    assert!(of(1.0, 0.0).is_some_and(|text| text.contains("time step")));
    assert!(of(1.0, 1e-3).is_none());
}
