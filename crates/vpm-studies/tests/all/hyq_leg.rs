//! The HyQ leg: every published and recomputed value, and three derivations of its equation of motion that agree.

use proptest::prelude::*;
use vpm_core::Dual;
use vpm_core::dynamics::Terms;
use vpm_core::samples::Random;
use vpm_studies::Result;
use vpm_studies::linkage::leg::{BODIES, DutyCycle, HyqData, Leg, LegParameters, ShareDefinition, ShareStudy, Shares};

use crate::values::check_all;

/// Rounding of three derivations through 21 equations, relative to the larger of torque and its largest term.
const TOLERANCE: f64 = 1e-10;
const PUBLIC_SHANK: f64 = 0.341;

fn hyq(data: HyqData, shank: f64) -> Result<Leg> {
    Ok(Leg::new(LegParameters::hyq(data, shank))?)
}

fn leg() -> Result<Leg> {
    hyq(HyqData::Cad, PUBLIC_SHANK)
}

fn degrees(angles: [f64; 2]) -> [f64; 2] {
    angles.map(f64::to_radians)
}

fn random_state(random: &mut Random) -> [[f64; 2]; 3] {
    let q = degrees([10.0 + 50.0 * random.symmetric(), -80.0 + 60.0 * random.symmetric()]);
    [q, [10.0 * random.symmetric(), 10.0 * random.symmetric()], [5.0 * random.symmetric(), 5.0 * random.symmetric()]]
}

fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// Largest difference of two results relative to the larger entries.
fn apart(left: [f64; 2], right: [f64; 2], scale: f64) -> f64 {
    largest([left[0] - right[0], left[1] - right[1]]) / scale
}

/// Largest disagreement of the three derivations in one state, relative to the torque.
fn disagreement(leg: &Leg, [q, v, a]: [[f64; 2]; 3]) -> Result<f64> {
    let work = leg.terms(q, v).effort(&a);
    let energy = leg.lagrange(q, v).effort(&a);
    let balance = leg.newton_euler(q, v, a)?.torques;
    let scale = largest(work);
    Ok(apart(work, energy, scale).max(apart(work, balance, scale)))
}

fn percent(shares: Shares) -> Vec<f64> {
    vec![100.0 * shares.inertia, 100.0 * shares.velocity, 100.0 * shares.gravity]
}

#[test]
fn the_shares_are_the_mean_of_their_map() -> Result<()> {
    let (leg, study) = (leg()?, ShareStudy::of(DutyCycle::MEDIUM));
    let mut sum = [0.0; 3];
    for i in 0..11 {
        for j in 0..13 {
            let q = degrees([-40.0 + 10.0 * f64::from(i), -140.0 + 10.0 * f64::from(j)]);
            let Shares { inertia, velocity, gravity } = leg.shares_at(q, &study)?;
            sum.iter_mut().zip([inertia, velocity, gravity]).for_each(|(sum, share)| *sum += share / 143.0);
        }
    }
    let mean = leg.shares(&study)?;
    let apart = [sum[0] - mean.inertia, sum[1] - mean.velocity, sum[2] - mean.gravity];
    assert!(apart.iter().all(|gap| gap.abs() < 1e-12), "{sum:?} {mean:?}");
    assert!(leg.shares_at([0.0; 2], &ShareStudy { samples: 1, ..study }).is_err());
    Ok(())
}

#[test]
fn every_value_of_the_leg_is_met() {
    let leg = leg().unwrap();
    let mut found = Vec::new();
    for (name, angles) in [("q-40_-140", [-40.0, -140.0]), ("q20_-80", [20.0, -80.0]), ("q60_-20", [60.0, -20.0])] {
        found.push((format!("hyq.stroke.{name}").leak() as &str, leg.strokes(degrees(angles)).to_vec()));
        found.push((format!("hyq.lever.{name}").leak(), leg.levers(degrees(angles)).to_vec()));
    }
    for (k, name, [low, high]) in [(0, "hip", [-50.0, 70.0]), (1, "knee", [-140.0, -20.0])] {
        let strokes =
            (0..=1000).map(|step| leg.strokes(degrees([low + (high - low) * f64::from(step) / 1000.0; 2]))[k]);
        let range = strokes.fold([f64::MAX, f64::MIN], |[low, high], s| [low.min(s), high.max(s)]);
        found.push((format!("hyq.stroke_range.{name}").leak(), range.to_vec()));
    }
    let (q, v, a) = (degrees([20.0, -80.0]), [2.0, -3.0], [4.0, -5.0]);
    let terms = leg.terms(q, v);
    let tau = terms.effort(&a);
    found.push(("hyq.M", terms.mass_matrix.as_flattened().to_vec()));
    found.push(("hyq.V", terms.velocity.to_vec()));
    found.push(("hyq.G", terms.gravity.to_vec()));
    found.push(("hyq.tau", tau.to_vec()));
    found.push(("hyq.cylinder_force", leg.cylinder_forces(q, tau).to_vec()));
    found.push(("hyq.ground_reaction", vec![leg.newton_euler(q, v, a).unwrap().ground]));
    let random = &mut Random::new(1);
    let worst = largest((0..400).map(|_| disagreement(&leg, random_state(random)).unwrap()));
    println!("three derivations differ by {worst:.1e} at most");
    found.push(("hyq.three_way_agreement", vec![worst]));
    for (shank, name) in [(0.341, "LLL341"), (0.375, "LLL375")] {
        let leg = hyq(HyqData::Cad, shank).unwrap();
        for (duty, cycle) in [("LD", DutyCycle::LOW), ("MD", DutyCycle::MEDIUM), ("HD", DutyCycle::HIGH)] {
            let shares = percent(leg.shares(&ShareStudy::of(cycle)).unwrap());
            println!("mu_M mu_V mu_G of {name} {duty}: {shares:.3?} %");
            if shank == PUBLIC_SHANK {
                found.push((format!("hyq.index.published.{duty}").leak(), shares.clone()));
            }
            found.push((format!("hyq.index.{name}.{duty}").leak(), shares));
        }
    }
    check_all("hyq.", &found).unwrap();
}

#[test]
fn with_the_longer_shank_the_published_shares_come_within_a_fifth_of_a_point() {
    let leg = hyq(HyqData::Cad, 0.375).unwrap();
    let published = [
        (DutyCycle::LOW, [6.57, 34.93, 99.17]),
        (DutyCycle::MEDIUM, [12.09, 65.57, 97.28]),
        (DutyCycle::HIGH, [20.34, 87.30, 90.90]),
    ];
    for (duty, expected) in published {
        let shares = percent(leg.shares(&ShareStudy::of(duty)).unwrap());
        assert!(largest(shares.iter().zip(expected).map(|(found, wanted)| found - wanted)) < 0.2, "{shares:?}");
    }
}

proptest! {
    #[test]
    fn three_derivations_agree(seed: u64, data in 0..3_usize) {
        let random = &mut Random::new(seed);
        let data = [HyqData::Cad, HyqData::Identified, HyqData::Plausible][data];
        let leg = hyq(data, 0.3 + 0.1 * random.unit()).unwrap();
        let [q, v, a] = random_state(random);
        let (work, energy) = (leg.terms(q, v), leg.lagrange(q, v));
        let parts = |terms: &Terms<f64, 2>| [terms.inertia(&a), terms.velocity, terms.gravity];
        for (left, right) in parts(&work).into_iter().zip(parts(&energy)) {
            prop_assert!(apart(left, right, largest(left)) < TOLERANCE);
        }
        let scale = largest(parts(&work).into_iter().flatten());
        let reactions = leg.newton_euler(q, v, a).unwrap();
        prop_assert!(apart(work.effort(&a), reactions.torques, scale) < TOLERANCE);
        prop_assert!(apart(leg.cylinder_forces(q, reactions.torques), reactions.cylinder_forces, scale / 0.02) < TOLERANCE);
    }

    #[test]
    fn the_leg_with_arbitrary_parameters_agrees_too(seed: u64) {
        let random = &mut Random::new(seed);
        let mut parameters = LegParameters::hyq(HyqData::Plausible, PUBLIC_SHANK);
        for body in [&mut parameters.upper, &mut parameters.lower] {
            body.mass = 0.1 + random.unit();
            body.center = [0.2 * random.symmetric(), 0.1 * random.symmetric()];
        }
        for part in parameters.actuators.iter_mut().flat_map(|pair| [&mut pair.barrel, &mut pair.rod]) {
            (part.mass, part.inertia, part.center) = (random.unit(), 0.01 * random.unit(), 0.2 * random.symmetric());
        }
        let leg = Leg::new(parameters).unwrap();
        let [q, v, a] = random_state(random);
        let work = leg.terms(q, v);
        let scale = largest([work.inertia(&a), work.velocity, work.gravity].into_iter().flatten());
        prop_assert!(apart(work.effort(&a), leg.lagrange(q, v).effort(&a), scale) < TOLERANCE);
        prop_assert!(apart(work.effort(&a), leg.newton_euler(q, v, a).unwrap().torques, scale) < TOLERANCE);
    }

    #[test]
    fn forward_dynamics_undoes_inverse_dynamics_and_the_mass_matrix_is_positive(seed: u64) {
        let leg = leg().unwrap();
        let [q, v, a] = random_state(&mut Random::new(seed));
        let terms = leg.terms(q, v);
        let found = leg.acceleration(q, v, terms.effort(&a)).unwrap();
        // Folded, the leg has little inertia in some direction: rounding grows with its condition.
        let [[xx, xy], [yx, yy]] = terms.mass_matrix;
        let determinant = xx * yy - xy * yx;
        prop_assert!((xy - yx).abs() < 1e-15 && xx > 0.0 && determinant > 0.0);
        let condition = (xx + yy) * (xx + yy) / determinant;
        prop_assert!(apart(a, found, 10.0) < 1e-13 * condition, "condition {condition}");
    }

    #[test]
    fn ground_and_guide_carry_the_momentum_of_the_whole_leg(seed: u64) {
        let leg = leg().unwrap();
        let [q, v, a] = random_state(&mut Random::new(seed));
        // The weight and the acceleration of the common centre of mass, by differences of its velocity.
        let momentum = |t: f64| {
            let lane = |k: usize| Dual::<f64, 1> {
                value: q[k] + v[k] * t + 0.5 * a[k] * t * t, gradient: [v[k] + a[k] * t],
            };
            let places = leg.places([lane(0), lane(1)]);
            let sum = |part: fn(&vpm_studies::linkage::leg::Place<Dual<f64, 1>>) -> f64| {
                places.iter().zip(leg.masses()).map(|(place, (mass, _))| mass * part(place)).sum::<f64>()
            };
            [sum(|place| place.center.x.gradient[0]), sum(|place| place.center.y.gradient[0])]
        };
        let h = 1e-5;
        let force = |k: usize| (momentum(h)[k] - momentum(-h)[k]) / (2.0 * h);
        let reactions = leg.newton_euler(q, v, a).unwrap();
        let weight: f64 = leg.masses().iter().map(|(mass, _)| mass * 9.81).sum();
        // Central differences of motions at 10 rad/s: h^2 times the third derivative.
        prop_assert!((reactions.ground - weight - force(1)).abs() < 1e-5 * (weight + force(1).abs()));
        prop_assert!((reactions.guide[0] - force(0)).abs() < 1e-5 * (weight + force(0).abs()));
    }

    #[test]
    fn power_of_the_cylinders_is_the_change_of_energy(seed: u64) {
        let leg = leg().unwrap();
        let [q, v, a] = random_state(&mut Random::new(seed));
        let lane = |k: usize| (Dual::<f64, 1> { value: q[k], gradient: [v[k]] }, Dual { value: v[k], gradient: [a[k]] });
        let ((q1, v1), (q2, v2)) = (lane(0), lane(1));
        let energy = leg.kinetic_energy([q1, q2], [v1, v2]) + leg.potential_energy([q1, q2]);
        let forces = leg.newton_euler(q, v, a).unwrap().cylinder_forces;
        let rates = leg.strokes([q1, q2]).map(|stroke| stroke.gradient[0]);
        let power = forces[0] * rates[0] + forces[1] * rates[1];
        prop_assert!((energy.gradient[0] - power).abs() < 1e-9 * (1.0 + largest([forces[0] * rates[0], forces[1] * rates[1]])));
    }

    #[test]
    fn levers_are_the_derivatives_of_the_strokes_and_strokes_follow_the_cosine_law(q1 in -0.8..1.2_f64, q2 in -2.4..-0.4_f64) {
        let leg = leg().unwrap();
        let strokes = leg.strokes([Dual::<f64, 2>::variable(q1, 0), Dual::variable(q2, 1)]);
        let levers = leg.levers([q1, q2]);
        prop_assert!((strokes[0].gradient[0] - levers[0]).abs() < 1e-15 && strokes[0].gradient[1].abs() < 1e-15);
        prop_assert!((strokes[1].gradient[1] - levers[1]).abs() < 1e-15 && strokes[1].gradient[0].abs() < 1e-15);
        let [hip, knee] = leg.parameters().attachments;
        let law = |base: f64, tip: f64, angle: f64| (base * base + tip * tip - 2.0 * base * tip * angle.cos()).sqrt();
        let angle = std::f64::consts::FRAC_PI_2 - q1 + hip.base_angle;
        prop_assert!((strokes[0].value - law(hip.base, hip.tip, angle)).abs() < 1e-15);
        let angle = std::f64::consts::PI + q2 - knee.base_angle - knee.tip_angle;
        prop_assert!((strokes[1].value - law(knee.base, knee.tip, angle)).abs() < 1e-15);
    }
}

#[test]
fn the_points_are_where_the_drawings_put_them() {
    // Straight down: q = 0. The public geometry in the frames of the legs.
    let points = leg().unwrap().points([0.0, 0.0]);
    let near = |point: [f64; 2], x: f64, y: f64| (point[0] - x).abs().max((point[1] - y).abs()) < 5e-6;
    assert!(near(points.hip.to_array(), 0.0, 0.691) && near(points.foot.to_array(), 0.0, 0.0));
    assert!(near((points.bases[0] - points.hip).to_array(), 0.319_99, 0.034_99));
    assert!(near((points.tips[0] - points.hip).to_array(), 0.0, -0.045));
    // K1 lies ahead of the line from knee to hip in q's sense of turning, K2 behind the shank.
    assert!(near((points.bases[1] - points.knee).to_array(), -0.045_01, 0.318_64));
    assert!(near((points.tips[1] - points.knee).to_array(), -0.004_70, -0.044_75));
    assert_eq!(BODIES.len(), 7);
    let total: f64 = leg().unwrap().masses().iter().map(|(mass, _)| mass).sum();
    assert!((total - 11.981).abs() < 1e-12);
}

#[test]
fn every_definition_of_the_shares_keeps_its_promise() {
    let leg = leg().unwrap();
    let random = &mut Random::new(7);
    for _ in 0..100 {
        let [q, v, a] = random_state(random);
        let terms = leg.terms(q, v);
        let [m, w, g] = ShareDefinition::SumOfNorms.shares(&terms, &a);
        assert!((m + w + g - 1.0).abs() < 1e-14);
        let [m, w, g] = ShareDefinition::RootOfSquares.shares(&terms, &a);
        assert!((m * m + w * w + g * g - 1.0).abs() < 1e-14);
        let torque = terms.effort(&a);
        let [_, _, gravity] = ShareDefinition::Torque.shares(&terms, &a);
        let weight = terms.gravity[0].hypot(terms.gravity[1]);
        assert!((gravity * torque[0].hypot(torque[1]) / weight - 1.0).abs() < 1e-12);
        let absolute = ShareDefinition::NormOfAbsoluteSum.shares(&terms, &a);
        assert!(absolute.iter().sum::<f64>() >= 1.0 - 1e-14 && absolute.iter().all(|&share| share <= 1.0 + 1e-14));
    }
    // With standstill among the samples the weight is everything there: a property of the sampling.
    let odd = ShareStudy { samples: 5, counts: [3, 3], ..ShareStudy::of(DutyCycle::HIGH) };
    assert_eq!(leg.shares(&odd).unwrap().gravity, 1.0);
    let other = ShareStudy { definition: ShareDefinition::NormOfAbsoluteSum, ..ShareStudy::of(DutyCycle::MEDIUM) };
    let both = [leg.shares(&other).unwrap(), leg.shares(&ShareStudy::of(DutyCycle::MEDIUM)).unwrap()].map(percent);
    assert!(largest(both[0].iter().zip(&both[1]).map(|(left, right)| left - right)) < 0.3);
}

#[test]
fn parameters_that_no_leg_can_have_are_refused() {
    let mut parameters = LegParameters::hyq(HyqData::Cad, -0.1);
    let refused = |parameters| Leg::new(parameters).unwrap_err().to_string();
    assert!(refused(parameters).starts_with("`leg.lower.length` must be positive, got -0.1"));
    parameters.lower.length = f64::INFINITY;
    assert!(refused(parameters).starts_with("`leg.lower.length` must be a finite number"));
    parameters = LegParameters::hyq(HyqData::Cad, PUBLIC_SHANK);
    parameters.actuators[1].rod.mass = -1.0;
    assert!(refused(parameters).starts_with("`leg.knee.rod.mass` must not be negative, got -1"));
    let study = ShareStudy { samples: 1, ..ShareStudy::of(DutyCycle::LOW) };
    assert!(leg().unwrap().shares(&study).unwrap_err().to_string().contains("be 2 or more, got 1"));
}
