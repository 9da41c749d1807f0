//! Empirical forces: each term against its formula; in machines exact state Jacobians, where the load comes from a command or from oil.

use std::f64::consts::TAU;

use serde_json::json;
use vpm_core::effect::{EmpiricalForce, Law};
use vpm_core::ode::Ode;
use vpm_core::samples::slider;

use crate::common::hydraulics::nominal;
use crate::common::servo_machine::{On, machine, rest};
use crate::common::{Machine, close};

const NUMBERS: [(&str, f64); 13] = [
    ("middle", 0.1),
    ("reach", 0.5),
    ("speed", 2.0),
    ("transition_velocity", 0.5),
    ("period", 0.3),
    ("position_3", 0.7),
    ("drag", 0.4),
    ("speed_2", -0.2),
    ("viscous_position", 0.3),
    ("dry_position", 0.6),
    ("dry_sine", -0.5),
    ("load_dry", 0.2),
    ("load_cosine", 0.1),
];

/// The Jacobian at `x` against differences of fourth order, column by column relative to its largest entry.
fn check_jacobian(machine: &Machine, x: &[f64], input: f64) {
    let (mut system, dim) = (machine.system(), x.len());
    system.hold(0, input);
    let (mut exact, mut sizes) = (vec![0.0; dim * dim], vec![0.0; dim]);
    system.jacobian(x, &mut exact);
    system.scales(&mut sizes);
    for column in 0..dim {
        let step = 1e-4 * sizes[column];
        let mut at = |side: f64| {
            let (mut moved, mut rates) = (x.to_vec(), vec![0.0; dim]);
            moved[column] += side * step;
            system.rhs(&moved, &mut rates);
            rates
        };
        let [near, far] = [1.0, 2.0].map(|side| {
            let (ahead, behind) = (at(side), at(-side));
            ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * side * step)).collect::<Vec<_>>()
        });
        let size = |row: usize| sizes[column] / sizes[row];
        let largest = (0..dim).map(|row| (exact[row * dim + column] * size(row)).abs()).fold(0.0, f64::max);
        for row in 0..dim {
            let difference = (4.0 * near[row] - far[row]) / 3.0;
            let gap = (difference - exact[row * dim + column]).abs() * size(row);
            assert!(gap < 1e-6 * largest.max(1e-3), "{row} {column}: {} {difference}", exact[row * dim + column]);
        }
    }
}

#[test]
fn state_jacobian_is_that_of_differences_under_a_command() {
    let mut machine = Machine::new(&slider(2.0));
    machine.effect("empirical_force", 0, &NUMBERS).actuator(0, &[("gain", 3.0), ("lag", 0.1)]);
    check_jacobian(&machine, &[0.23, 0.7, 0.4], 1.3);
    check_jacobian(&machine, &[-0.31, -0.4, -0.8], 1.3);
    // Outside of the range that was seen.
    check_jacobian(&machine, &[1.7, 3.1, 0.4], -0.2);
}

#[test]
fn state_jacobian_is_that_of_differences_under_oil_pressure() {
    let mut machine = machine(&nominal(), On::Joint);
    let mut x = rest(&machine);
    machine.effect("empirical_force", 0, &NUMBERS);
    let dim = x.len();
    // The valve away from its corner at zero.
    (x[0], x[1], x[2], x[3]) = (x[0] + 0.003, 0.2, 1e-3, 2e-3);
    // Chambers are the last two: a pressure difference that pushes.
    (x[dim - 2], x[dim - 1]) = (x[dim - 2] + 2e6, x[dim - 1] - 1e6);
    check_jacobian(&machine, &x, 1e-3);
    (x[dim - 2], x[dim - 1]) = (x[dim - 2] - 5e6, x[dim - 1] + 3e6);
    check_jacobian(&machine, &x, 1e-3);
}

#[test]
fn each_term_is_what_the_formula_says() -> serde_json::Result<()> {
    // By place x, speed y, direction s and phase phi; those of the load by its size.
    type Term = fn(f64, f64, f64, f64) -> f64;
    let terms: [(&str, Term); 20] = [
        ("constant", |_, _, _, _| 1.0),
        ("position", |x, _, _, _| x),
        ("position_2", |x, _, _, _| x * x),
        ("position_3", |x, _, _, _| x * x * x),
        ("cosine", |_, _, _, phi| phi.cos()),
        ("sine", |_, _, _, phi| phi.sin()),
        ("viscous", |_, y, _, _| y),
        ("speed_2", |_, y, _, _| y * y),
        ("drag", |_, y, _, _| y * y.abs()),
        ("speed_3", |_, y, _, _| y * y * y),
        ("viscous_position", |x, y, _, _| y * x),
        ("viscous_position_2", |x, y, _, _| y * x * x),
        ("dry", |_, _, s, _| s),
        ("dry_position", |x, _, s, _| s * x),
        ("dry_position_2", |x, _, s, _| s * x * x),
        ("dry_cosine", |_, _, s, phi| s * phi.cos()),
        ("dry_sine", |_, _, s, phi| s * phi.sin()),
        ("load_dry", |_, _, s, _| 3.0 * s),
        ("load_cosine", |_, _, _, phi| 3.0 * phi.cos()),
        ("load_sine", |_, _, _, phi| 3.0 * phi.sin()),
    ];
    for (name, term) in terms {
        for period in [Some(0.3), None] {
            let mut numbers = json!({"middle": 0.1, "reach": 0.5, "speed": 2.0, "transition_velocity": 0.4});
            numbers[name] = json!(0.4);
            period.iter().for_each(|&period| numbers["period"] = json!(period));
            let law: EmpiricalForce<f64> = serde_json::from_value(numbers)?;
            assert_eq!(law.follows_load(), name.starts_with("load"));
            // Within the range that was seen, and beyond it.
            for (q, v) in [(0.23, 0.7), (-0.15, -1.3), (0.1, 0.0), (1.9, 5.0), (-3.0, -2.5)] {
                let [x, y] = [(q - 0.1) / 0.5, v / 2.0].map(|share: f64| share.clamp(-1.0, 1.0));
                let expected = -0.4 * term(x, y, (v / 0.4).tanh(), TAU * q / period.unwrap_or(1.0));
                close(law.effort_under(q, v, -3.0), expected, 1e-13);
            }
        }
    }
    Ok(())
}

#[test]
fn it_never_takes_more_than_its_share_of_the_load_and_stays_finite() {
    let law = EmpiricalForce {
        middle: 0.0,
        reach: 0.5,
        speed: 2.0,
        transition_velocity: 1e-9,
        period: None,
        constant: Some(1.0),
        position: None,
        position_2: None,
        position_3: Some(2.0),
        cosine: None,
        sine: None,
        viscous: None,
        speed_2: None,
        drag: Some(3.0),
        speed_3: None,
        viscous_position: None,
        viscous_position_2: None,
        dry: Some(4.0),
        dry_position: None,
        dry_position_2: None,
        dry_cosine: None,
        dry_sine: None,
        load_dry: Some(7.0),
        load_cosine: None,
        load_sine: None,
    };
    close(law.share_of_load(0.1, 1.0, 3.0), 0.95, 0.0);
    close(law.share_of_load(0.1, -1.0, 3.0), -0.95, 0.0);
    close(law.effort(1e9, 1e9), -10.0, 1e-12);
    close(law.effort(1e9, -1e9), 4.0, 1e-12);
    // In one piece: at the edge and just beyond, the efforts agree.
    close(law.effort(0.5, 2.0), law.effort(0.5 + 1e-12, 2.0 + 1e-12), 1e-9);
    for v in [0.0, 1e-7, -0.3, 2.0, -2.5, 1e12] {
        close(law.effort_at_rest(0.2) - law.resistance(0.2, v) * v, law.effort(0.2, v), 1e-12);
        assert!(law.resistance(0.2, v).is_finite());
    }
}
