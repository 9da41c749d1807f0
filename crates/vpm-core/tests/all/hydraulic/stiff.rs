//! What a servo-cylinder does to its integrators: impacts on the ends, full reversals, voids; which steps each needs.

use vpm_core::actuator::hydraulic::{ServoCylinder, ServoRig};
use vpm_core::contact::NormalContact;
use vpm_core::error::Error;
use vpm_core::integrator::{Adaptive, Integrator, Method};
use vpm_core::ode::Ode;
use vpm_core::{Dual, Scalar};

use crate::common::hydraulics::{Chirp, Chirped, nominal};
use crate::common::values;

type TestResult = Result<(), Box<dyn std::error::Error>>;

/// Ends of the samples of 1 ms, with the number of steps that the longest took.
struct Motion {
    rows: Vec<[f64; 6]>,
    most: usize,
    all: usize,
}

/// A rig from `start` under one current a millisecond.
fn drive(
    servo: &ServoCylinder<f64>,
    start: [f64; 6],
    currents: &[f64],
    method: Method,
    pieces: usize,
) -> Option<Motion> {
    let mut rig = ServoRig::new(*servo).ok()?;
    let (mut x, mut motion) = (start, Motion { rows: Vec::new(), most: 0, all: 0 });
    let mut adaptive = match method {
        Method::Adaptive { tolerance } => Adaptive::new(tolerance, 6).ok(),
        Method::Guarded => Some(Adaptive::guarded(6)),
        _ => None,
    };
    let mut integrator = Integrator::new(method, 6);
    for &current in currents {
        rig.current = current;
        let mut steps = pieces;
        match &mut adaptive {
            Some(adaptive) => {
                steps = 0;
                for _ in 0..pieces {
                    let taken = adaptive.advance(&mut rig, &mut x, 1e-3 / pieces as f64, &|| false).ok()?;
                    steps += taken.accepted + taken.refused;
                }
            }
            None => integrator.advance(&mut rig, &mut x, (1e-3, pieces), &|| false).ok()?,
        }
        if !x.iter().all(|number| number.is_finite()) {
            return None;
        }
        (motion.most, motion.all) = (motion.most.max(steps), motion.all + steps);
        motion.rows.push(x);
    }
    Some(motion)
}

/// Largest differences of place (m), velocity (m/s) and pressures (of 16 MPa).
fn apart(left: &Motion, right: &Motion) -> [f64; 3] {
    let worst = |k: usize| left.rows.iter().zip(&right.rows).map(|(l, r)| (l[k] - r[k]).abs()).fold(0.0, f64::max);
    [worst(0), worst(2), worst(4).max(worst(5)) / 16e6]
}

/// Into one end and back into the other with all that the valve gives.
fn impacts() -> (ServoCylinder<f64>, [f64; 6], Vec<f64>) {
    let servo = nominal();
    (servo, servo.rest().to_array(), (0..200).map(|k| if k < 80 { 0.01 } else { -0.01 }).collect())
}

/// The whole current to and fro every few milliseconds, a light load: the oil boils.
fn reversals() -> (ServoCylinder<f64>, [f64; 6], Vec<f64>) {
    let mut servo = nominal();
    servo.load.damping = 50.0;
    let start = servo.rest().to_array();
    (servo, start, (0..100).map(|k| if (k / 3) % 2 == 0 { 0.01 } else { -0.01 }).collect())
}

/// A piston thrown with the valve shut: a void opens and closes.
fn void() -> (ServoCylinder<f64>, [f64; 6], Vec<f64>) {
    let mut servo = nominal();
    servo.cylinder.internal_leakage = 0.0;
    let mut start = servo.rest().to_array();
    start[2] = -2.0;
    (servo, start, vec![0.0; 100])
}

/// A method in pieces of a sample, and the largest errors of place (m), velocity (m/s) and pressures (of 16 MPa) and most steps of a
/// sample that it may have.
type Row = (Method, usize, [f64; 3], usize);

const fn adaptive(tolerance: f64) -> Method {
    Method::Adaptive { tolerance }
}

fn check(
    name: &str,
    (servo, start, currents): &(ServoCylinder<f64>, [f64; 6], Vec<f64>),
    agree: [f64; 3],
    rows: &[Row],
) {
    let run = |method, pieces| drive(servo, *start, currents, method, pieces).unwrap();
    // The finest steps of controlled error, and as a witness 2000 equal ones a millisecond, which impacts cut at the wrong places.
    let exact = run(adaptive(1e-10), 1);
    let witness = apart(&exact, &run(Method::Rosenbrock, 2000));
    assert!(
        witness.iter().zip(agree).all(|(found, bound)| *found < bound),
        "{name}: the witness is off by {witness:?}"
    );
    for &(method, pieces, bounds, steps) in rows {
        let motion = run(method, pieces);
        let error = apart(&motion, &exact);
        let shown = error.map(|part| format!("{part:.1e}")).join(", ");
        println!("{name}, {method} x {pieces}: {shown}; {} steps, {} at most in 1 ms", motion.all, motion.most);
        assert!(error.iter().zip(bounds).all(|(found, bound)| *found < bound), "{name}, {method} x {pieces}: {shown}");
        assert!(motion.most <= steps, "{name}, {method}: {} steps in 1 ms", motion.most);
    }
}

/// Whether steps of 1 ms lose the motion: not finite, or off by more than the stroke.
fn lost(case: &(ServoCylinder<f64>, [f64; 6], Vec<f64>), method: Method, pieces: usize) -> bool {
    let (servo, start, currents) = case;
    drive(servo, *start, currents, method, pieces).is_none_or(|motion| motion.rows.iter().any(|x| x[0].abs() > 0.08))
}

#[test]
fn impacts_on_both_ends() {
    let rows = [
        (adaptive(1e-4), 1, [1e-6, 3e-3, 1e-3], 300),
        (adaptive(1e-6), 1, [2e-9, 1e-5, 5e-6], 600),
        (adaptive(1e-8), 1, [3e-11, 1e-7, 3e-8], 1500),
        (Method::Guarded, 1, [2e-4, 0.2, 0.05], 36),
        (Method::LinearlyImplicit, 10, [1e-4, 0.1, 0.2], 10),
        (Method::Rosenbrock, 10, [3e-4, 0.4, 0.4], 10),
    ];
    check("impacts", &impacts(), [1e-6, 2e-3, 2e-3], &rows);
    assert!(lost(&impacts(), Method::Rosenbrock, 1) && lost(&impacts(), Method::LinearlyImplicit, 1));
}

#[test]
fn full_reversals_with_voids() {
    let rows = [
        (adaptive(1e-4), 1, [1e-6, 3e-4, 5e-4], 100),
        (adaptive(1e-6), 1, [2e-8, 5e-6, 1e-5], 300),
        (adaptive(1e-8), 1, [2e-10, 5e-8, 1e-7], 600),
        (Method::Guarded, 1, [2e-4, 0.02, 0.05], 36),
        (Method::LinearlyImplicit, 10, [1e-4, 0.02, 0.05], 10),
        (Method::Rosenbrock, 10, [3e-5, 0.01, 0.02], 10),
    ];
    check("reversals", &reversals(), [1e-9, 1e-6, 1e-6], &rows);
}

#[test]
fn a_void_that_closes() {
    let rows = [
        (adaptive(1e-4), 1, [3e-7, 4e-4, 4e-4], 40),
        (adaptive(1e-6), 1, [6e-9, 8e-6, 8e-6], 80),
        (adaptive(1e-8), 1, [5e-11, 6e-8, 6e-8], 200),
        (Method::Guarded, 1, [4e-5, 0.05, 0.05], 36),
        (Method::Rosenbrock, 4, [5e-6, 6e-3, 6e-3], 4),
    ];
    check("void", &void(), [1e-10, 1e-7, 1e-7], &rows);
}

#[test]
fn shut_valves_keep_the_oil_through_voids() {
    let (servo, start, currents) = void();
    // Without air the density is exp(state / beta), in voids too.
    let masses = |x: &[f64; 6]| {
        let (volumes, beta) = (servo.cylinder.volumes(x[0]), servo.fluid.bulk_modulus);
        [volumes.a * (x[4] / beta).exp(), volumes.b * (x[5] / beta).exp()]
    };
    for (method, bound) in [(adaptive(1e-6), 2e-6), (adaptive(1e-8), 2e-8), (Method::Guarded, 2e-3)] {
        let motion = drive(&servo, start, &currents, method, 1).unwrap();
        assert!(motion.rows.iter().any(|x| x[4].min(x[5]) < 0.0), "no void");
        let before = masses(&start);
        let change =
            |x| masses(x).into_iter().zip(before).map(|(now, then)| (now / then - 1.0).abs()).fold(0.0, f64::max);
        let worst = motion.rows.iter().map(change).fold(0.0, f64::max);
        println!("{method}: the mass changes by {worst:.1e}");
        assert!(worst < bound, "{method}: the mass changes by {worst}");
    }
}

#[test]
fn a_bounce_on_an_end_gives_back_no_more_than_it_took() {
    // Nothing but the stop: the chambers are voids, and vapour without pressure.
    let mut servo = nominal();
    (servo.load.damping, servo.load.stiffness, servo.cylinder.internal_leakage) = (0.0, 0.0, 0.0);
    servo.fluid.vapour_pressure = 1e-6;
    let start = [0.0355, 0.0, 1.0, 0.0, -2e9, -2e9];
    for (damping, lossless) in [(0.0, true), (2e4, false)] {
        servo.cylinder.stop.damping = damping;
        // Off the end again after 10 ms; the closed form of half a swing of a damped spring, cut where it would pull.
        let ratio = 0.5 * damping / (servo.cylinder.stop.stiffness * servo.load.mass).sqrt();
        let swing = (1.0 - ratio * ratio).sqrt();
        let expected = if lossless {
            1.0
        } else {
            (-ratio / swing * (2.0 * ratio * swing).atan2(2.0 * ratio * ratio - 1.0)).exp()
        };
        for (method, bound) in [(adaptive(1e-6), 1e-4), (adaptive(1e-8), 1e-5), (Method::Guarded, 0.05)] {
            let back = -drive(&servo, start, &[0.0; 10], method, 1).unwrap().rows[9][2];
            println!("{method}, damping {damping}: back with {back} m/s, {expected} by the closed form");
            assert!((back - expected).abs() < bound, "{method}: back with {back} instead of {expected} m/s");
            assert!(back < 1.0 + bound, "{method}: it gained energy, {back} m/s");
        }
    }
}

/// A mass on the contact law of a foot, over a height that is `[y, v]`.
struct Foot {
    law: NormalContact<f64>,
    lifted: NormalContact<Dual<f64, 2>>,
}

impl Foot {
    fn rates<S: Scalar>(law: &NormalContact<S>, [y, v]: [S; 2]) -> [S; 2] {
        [v, law.force(-y, -v) / 11.981 - 9.81]
    }
}

impl Ode<f64> for Foot {
    fn dim(&self) -> usize {
        2
    }
    fn coordinates(&self) -> usize {
        1
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        dxdt.copy_from_slice(&Self::rates(&self.law, [x[0], x[1]]));
    }
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        let rates = Self::rates(&self.lifted, [Dual::variable(x[0], 0), Dual::variable(x[1], 1)]);
        for (row, rate) in jacobian.chunks_exact_mut(2).zip(rates) {
            row.copy_from_slice(&rate.gradient);
        }
    }
    fn scales(&self, scales: &mut [f64]) {
        scales.copy_from_slice(&[1e-2, 1.0]);
    }
}

#[test]
fn a_foot_that_drops_on_the_ground() {
    let law =
        |damping| NormalContact { stiffness: 2855.0 * 1000_f64.powf(1.1), exponent: 1.1, damping, damping_depth: 1e-4 };
    let run = |damping, method, pieces| -> Vec<[f64; 2]> {
        let law: NormalContact<f64> = law(damping);
        let mut ode = Foot { law, lifted: law.map(&mut |&number| Dual::constant(number)) };
        let (mut x, mut integrator) = ([0.05, 0.0], Integrator::new(method, 2));
        let mut sample = || {
            integrator.advance(&mut ode, &mut x, (1e-3, pieces), &|| false).unwrap();
            x
        };
        (0..400).map(|_| sample()).collect()
    };
    for damping in [0.0, 1000.0] {
        let exact = run(damping, adaptive(1e-11), 1);
        let apart = |found: &[[f64; 2]]| found.iter().zip(&exact).map(|(l, r)| (l[1] - r[1]).abs()).fold(0.0, f64::max);
        let witness = apart(&run(damping, Method::Rk4, 2000));
        assert!(witness < 1e-3, "steps of 0.5 us are off by {witness} m/s");
        for (method, bound, gained) in
            [(adaptive(1e-6), 2e-3, 1e-4), (adaptive(1e-8), 1e-4, 1e-6), (Method::Guarded, 1.0, 0.1)]
        {
            let found = run(damping, method, 1);
            let error = apart(&found);
            let energy = |x: &[f64; 2]| 0.5 * x[1] * x[1] + 9.81 * x[0];
            let gain =
                found.iter().filter(|x| x[0] > 0.0).map(|x| energy(x) / (9.81 * 0.05) - 1.0).fold(f64::MIN, f64::max);
            println!("{method}, damping {damping}: velocity off by {error:.1e} m/s, energy up by {gain:.1e}");
            assert!(error < bound && gain < gained, "{method}: {error} m/s, {gain}");
        }
    }
}

/// A jump of the current and back.
fn step_values(method: Method, pieces: usize) -> Result<Vec<(String, Vec<f64>)>, Error> {
    let servo = nominal();
    let (mut x, mut rig, mut integrator) = (servo.rest().to_array(), ServoRig::new(servo)?, Integrator::new(method, 6));
    let mut found = Vec::new();
    for ms in 1..=100 {
        rig.current = if ms <= 50 { 2e-3 } else { -2e-3 };
        integrator.advance(&mut rig, &mut x, (1e-3, pieces), &|| false)?;
        if [1, 2, 5, 10, 20, 50, 51, 55, 60, 100].contains(&ms) {
            found.push((format!("hyd.H1.step.t{ms:03}ms"), vec![x[4], x[5], x[0], x[2]]));
        }
    }
    Ok(found)
}

/// A chirp of 2 s.
fn chirp_values(method: Method, pieces: usize) -> Result<Vec<(String, Vec<f64>)>, Error> {
    let chirp = Chirp { amplitude: 0.5e-3, start: std::f64::consts::TAU, slope: 0.5 * 19.0 * std::f64::consts::TAU };
    let mut ode = Chirped::new(nominal(), chirp);
    let (mut x, mut integrator, mut found) = (ode.rest(), Integrator::new(method, 7), Vec::new());
    for ms in 1..=2000 {
        integrator.advance(&mut ode, &mut x, (1e-3, pieces), &|| false)?;
        if [100, 200, 300, 500, 750, 1000, 1250, 1500, 1750, 2000].contains(&ms) {
            found.push((format!("hyd.H2.chirp.t{ms:04}ms"), vec![x[4], x[5], x[0], x[2]]));
        }
    }
    Ok(found)
}

#[test]
fn published_values_at_samples_of_one_millisecond() -> TestResult {
    type Values = fn(Method, usize) -> Result<Vec<(String, Vec<f64>)>, Error>;
    let rows: [(&str, Values, Method, usize); 6] = [
        ("hyd.H1.", step_values, adaptive(1e-6), 1),
        ("hyd.H1.", step_values, adaptive(1e-7), 1),
        ("hyd.H1.", step_values, Method::Rosenbrock, 40),
        ("hyd.H2.", chirp_values, adaptive(1e-7), 1),
        ("hyd.H2.", chirp_values, Method::Rosenbrock, 20),
        ("hyd.H2.", chirp_values, Method::Rosenbrock, 40),
    ];
    for (prefix, run, method, pieces) in rows {
        let found = run(method, pieces)?;
        let found: Vec<(&str, Vec<f64>)> =
            found.iter().map(|(name, numbers)| (name.as_str(), numbers.clone())).collect();
        let used = values::check_all(prefix, &found)?;
        println!("{prefix} {method} x {pieces}: {:.0} % of the tolerance", 100.0 * used);
    }
    Ok(())
}
