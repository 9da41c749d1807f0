//! Orders of convergence of the integrators.

use vpm_core::Result;
use vpm_core::beam::{Component, DampingEntry, Level};
use vpm_core::description::Description;
use vpm_core::integrator::{Integrator, Method};
use vpm_core::model::Parts;
use vpm_core::ode::Ode;
use vpm_core::samples::double_pendulum;

use super::{Row, Tolerance, slopes};
use crate::common::trees;

/// A method, its order, and the coarsest number of steps on the rigid and on the flexible machine.
const METHODS: [(Method, f64, [usize; 2]); 4] = [
    (Method::SemiImplicit, 1.0, [1024, 2048]),
    (Method::LinearlyImplicit, 2.0, [1024, 512]),
    (Method::Rosenbrock, 4.0, [128, 64]),
    (Method::Rk4, 4.0, [128, 256]),
];

/// Each method on a double pendulum and on an arm with a beam.
pub fn rows() -> Result<Vec<Row>> {
    let pendulum = double_pendulum([1.0, 0.7], [0.5, 0.4]);
    let rigid = Parts { gravity: pendulum.gravity, bodies: pendulum.bodies, ..Parts::default() };
    let mut flexible = slopes::arm(Level::Strain(2));
    flexible.beams[0].deforms = vec![Component::BendingX, Component::BendingY];
    flexible.beams[0].damping = DampingEntry::default();
    let mut rows = Vec::new();
    for (place, (name, parts, time)) in
        [("a double pendulum", rigid, 0.8), ("an arm with a beam", flexible, 0.1)].into_iter().enumerate()
    {
        let d = trees::try_description(&parts, |_| ())?;
        let mut start = vec![0.0; d.n_states()];
        (start[0], start[1]) = (0.6, -0.4);
        let exact = state(&d, &start, time, (Method::Rk4, 8192))?;
        for (method, order, coarse) in METHODS {
            let error =
                |steps: usize| -> Result<f64> { Ok(distance(&state(&d, &start, time, (method, steps))?, &exact)) };
            let [first, second, third] = [1, 2, 4].map(|times| error(times * coarse[place]));
            let (first, second, third): (f64, f64, f64) = (first?, second?, third?);
            rows.push(Row {
                name: format!("Order of {} on {name}", method.name()),
                found: vec![(first / second).log2(), (second / third).log2()],
                expected: vec![order; 2],
                unit: "-",
                source: "order of the method; errors against rk4 at 8192 steps",
                tolerance: Tolerance::Absolute(0.15),
            });
        }
    }
    Ok(rows)
}

fn state(d: &Description, start: &[f64], time: f64, (method, steps): (Method, usize)) -> Result<Vec<f64>> {
    let mut system = d.system::<f64>(&d.parameters)?;
    let (mut x, mut integrator) = (start.to_vec(), Integrator::new(method, system.dim()));
    for _ in 0..steps {
        integrator.step(&mut system, &mut x, time / steps as f64);
    }
    Ok(x)
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
