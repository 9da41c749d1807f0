//! The two-node element in absolute coordinates, and with it, independently, the strain beam at large deflection.

use std::f64::consts::TAU;

use vpm_core::Result;
use vpm_core::beam::Component;
use vpm_core::beam::Section;
use vpm_core::beam::witness::strain_tree::{FlexibleLink, FlexibleTree, StrainBeam, TipLoad};
use vpm_core::beam::witness::two_node::{ELEMENT, NodeLoad, TwoNode, TwoNodeChain, rotation};
use vpm_core::error::Error;
use vpm_core::samples::Random;
use vpm_core::spatial::{Matrix3, Pose, Vector3};

use crate::common::beams::{fields, near};

const MASS: [f64; 6] = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];

/// Bending stiffness 1, shear and extension next to rigid.
fn slender() -> Result<Section> {
    Section::given([1.0, 1.0, 1.0, 1e9, 1e9, 1e7], MASS)
}

/// Euler parameters of a turn.
fn parameters(axis: [f64; 3], angle: f64) -> [f64; 4] {
    let (sin, cos) = (0.5 * angle).sin_cos();
    [cos, sin * axis[0], sin * axis[1], sin * axis[2]]
}

fn element([p, a]: [&[f64]; 2], [q, b]: [&[f64]; 2]) -> [f64; ELEMENT] {
    let all = [p, a, q, b].concat();
    std::array::from_fn(|k| all[k])
}

/// Position and Euler parameters of the last node.
fn tip(coordinates: &[f64]) -> &[f64] {
    &coordinates[coordinates.len() - 7..]
}

#[test]
fn euler_parameters_turn_as_the_axis_and_angle_do() {
    let (axis, angle) = ([2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0], 2.2);
    let (found, known) = (rotation(parameters(axis, angle)), Matrix3::rotation(Vector3::from_f64(axis), angle));
    for (found, known) in found.columns.iter().zip(known.columns) {
        near(&found.to_array(), &known.to_array(), 1e-15);
    }
}

#[test]
fn a_rigid_motion_deforms_nothing_and_each_measure_has_its_closed_form() -> Result<()> {
    let section = Section::given([3.0, 2.0, 1.5, 20.0, 25.0, 40.0], MASS)?;
    let bar = TwoNode::new(&section, 0.5)?;
    let (axis, place) = ([0.6, 0.0, 0.8], [0.3, -1.0, 2.0]);
    let turn = parameters(axis, 1.1);
    let along = rotation(turn).columns[2] * 0.5;
    let end = [0, 1, 2].map(|k| place[k] + along.to_array()[k]);
    near(&bar.deformation(&element([&place, &turn], [&end, &turn])), &[0.0; 6], 1e-15);
    let still = [1.0, 0.0, 0.0, 0.0];
    let measure = |end: [f64; 3], turn: [f64; 4]| bar.deformation(&element([&[0.0; 3], &still], [&end, &turn]));
    near(&measure([0.0, 0.0, 0.53], still), &[0.03, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-15);
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let sine = 0.5 * 0.4_f64.sin();
    near(&measure([0.0, 0.0, 0.5], parameters(z, 0.4)), &[0.0, sine, 0.0, 0.0, 0.0, 0.0], 1e-15);
    near(&measure([0.0, 0.0, 0.5], parameters(x, 0.4)), &[0.0, 0.0, 0.0, sine, 0.0, 0.0], 1e-15);
    near(&measure([0.0, 0.0, 0.5], parameters(y, 0.4)), &[0.0, 0.0, 0.0, 0.0, 0.0, sine], 1e-15);
    // The end moves across without a turn: both nodes lean against the line, by the same angle.
    let lean = [0.3, 0.0, 0.4];
    near(&measure(lean, still), &[0.0, 0.0, 0.0, 0.0, 0.3, -0.3], 1e-15);
    Ok(())
}

#[test]
fn nodal_forces_are_the_derivative_of_the_energy_and_balance_each_other() -> Result<()> {
    let section = Section::given([3.0, 2.0, 1.5, 20.0, 25.0, 40.0], MASS)?;
    let bar = TwoNode::new(&section, 0.5)?;
    let mut random = Random::new(3);
    for _ in 0..5 {
        let mut x: [f64; ELEMENT] = random.numbers(ELEMENT, 0.2).try_into().unwrap();
        (x[3], x[9], x[10]) = (x[3] + 1.0, x[9] + 0.5, x[10] + 1.0);
        let forces = bar.forces(&x);
        for k in 0..ELEMENT {
            let side = |step: f64| {
                let mut moved = x;
                moved[k] += step;
                bar.energy(&moved)
            };
            let slope = (side(1e-6) - side(-1e-6)) / 2e-6;
            assert!((forces[k] - slope).abs() < 1e-7 * (1.0 + slope.abs()), "{k}: {} is not {slope}", forces[k]);
        }
        for k in 0..3 {
            assert!((forces[k] + forces[7 + k]).abs() < 1e-12);
        }
    }
    Ok(())
}

#[test]
fn small_deflections_are_those_of_timoshenko_with_a_single_element() -> Result<()> {
    let section = Section::given([5.0, 6.0, 7.0, 8.0, 9.0, 10.0], MASS)?;
    let (chain, small) = (TwoNodeChain::new(&section, 2.0, 1)?, 1e-6);
    let load = NodeLoad { force: [small, 2.0 * small, 0.0], moment: [0.0, 0.0, 3.0 * small] };
    let found = chain.equilibrium(&chain.straight(), &load)?;
    // F L^3 / 3 EJ + F L / aGA in both planes, half of m L / GJ as the third parameter.
    let across = [8.0 / 18.0 + 2.0 / 8.0, 2.0 * (8.0 / 15.0 + 2.0 / 9.0)].map(|factor| small * factor);
    near(&tip(&found)[..2], &across, 1e-11);
    near(&tip(&found)[6..], &[0.5 * 3.0 * small * 2.0 / 7.0], 1e-11);
    let pulled = chain.equilibrium(&chain.straight(), &NodeLoad { force: [0.0, 0.0, 0.5], ..NodeLoad::default() })?;
    near(&tip(&pulled)[..3], &[0.0, 0.0, 2.1], 1e-12);
    Ok(())
}

/// P L^2 / EJ, transverse and axial displacement of the tip over L: elliptic integrals (Mattiasson 1981).
const ELASTICA: [[f64; 3]; 6] = [
    [1.0, 0.301_720_773_799_813_55, 0.056_433_236_283_376_88],
    [2.0, 0.493_457_480_396_711_83, 0.160_641_720_825_167_23],
    [4.0, 0.669_964_181_277_666_8, 0.328_941_242_246_845_96],
    [6.0, 0.744_571_148_889_515_3, 0.434_588_628_681_905_1],
    [8.0, 0.784_982_374_953_314_6, 0.504_827_732_133_531_6],
    [10.0, 0.810_609_024_880_296_4, 0.554_995_597_753_751_3],
];

/// Difference of a tip of a chain from its exact place.
fn gap(coordinates: &[f64], exact: [f64; 3]) -> Vector3<f64> {
    Vector3::from_f64([0, 1, 2].map(|k| tip(coordinates)[k] - exact[k]))
}

fn size(v: Vector3<f64>) -> f64 {
    v.dot(v).sqrt()
}

/// Errors fall with the square of the number of elements, doubled each time; what remains without that part is below `rest`.
fn second_order(gaps: [Vector3<f64>; 3], rest: f64) {
    let [coarse, middle, fine] = gaps.map(size);
    for order in [(coarse / middle).log2(), (middle / fine).log2()] {
        assert!((order - 2.0).abs() < 0.3, "order {order} from {coarse}, {middle}, {fine}");
    }
    let left = size(gaps[2] * (4.0 / 3.0) - gaps[1] * (1.0 / 3.0));
    assert!(left < rest, "{left} remains of {fine}");
}

/// Errors at rising loads, of the tip of a chain of `count` elements that is bent in the plane at `angle`.
fn elastica_gaps(count: usize, angle: f64) -> Result<Vec<Vector3<f64>>> {
    let (chain, (sin, cos)) = (TwoNodeChain::new(&slender()?, 1.0, count)?, angle.sin_cos());
    let mut x = chain.straight();
    let mut gaps = Vec::new();
    for [load, across, along] in ELASTICA {
        x = chain.equilibrium(&x, &NodeLoad { force: [load * cos, load * sin, 0.0], ..NodeLoad::default() })?;
        gaps.push(gap(&x, [across * cos, across * sin, 1.0 - along]));
    }
    Ok(gaps)
}

#[test]
fn a_tip_load_bends_the_elastica_as_the_elements_get_shorter() -> Result<()> {
    let (coarse, middle, fine) = (elastica_gaps(8, 0.7)?, elastica_gaps(16, 0.7)?, elastica_gaps(32, 0.7)?);
    for ((&coarse, &middle), &fine) in coarse.iter().zip(&middle).zip(&fine) {
        second_order([coarse, middle, fine], 2e-5);
    }
    Ok(())
}

/// Errors of the tip of a chain of `count` elements under the moments that bend it to half a circle and to a full one.
fn circle_gaps(count: usize) -> Result<[Vector3<f64>; 2]> {
    let chain = TwoNodeChain::new(&slender()?, 1.0, count)?;
    let (mut x, mut half) = (chain.straight(), Vector3::zero());
    for stage in 1..=16 {
        let phi = TAU * f64::from(stage) / 16.0;
        x = chain.equilibrium(&x, &NodeLoad { moment: [0.0, phi, 0.0], ..NodeLoad::default() })?;
        if stage == 8 {
            // Constant curvature: (1 - cos phi) / phi across, sin phi / phi along.
            half = gap(&x, [4.0 / TAU, 0.0, 0.0]);
        }
    }
    Ok([half, gap(&x, [0.0; 3])])
}

#[test]
fn a_tip_moment_rolls_the_chain_up_to_a_circle_as_the_elements_get_shorter() -> Result<()> {
    let [coarse, middle, fine] = [circle_gaps(8)?, circle_gaps(16)?, circle_gaps(32)?];
    second_order([coarse[0], middle[0], fine[0]], 2e-4);
    second_order([coarse[1], middle[1], fine[1]], 2e-3);
    Ok(())
}

#[test]
fn in_space_the_chain_tends_to_the_strain_beam() -> Result<()> {
    // Unequal bending, soft twist: a force across, a pull and a moment about all axes give a space curve.
    let section = Section::given([1.0, 2.0, 0.7, 1e9, 1e9, 400.0], MASS)?;
    let (force, moment) = ([1.2, -0.8, 0.5], [0.3, 0.2, 0.6]);
    let list = [(Component::BendingX, 8), (Component::BendingY, 8), (Component::Torsion, 8), (Component::Extension, 4)];
    let beam = StrainBeam::new(section, fields(1.0, &list)?, 0.0, 24)?;
    let link = FlexibleLink { beam: Some((Pose::identity(), beam)), ..FlexibleLink::welded() };
    let tree = FlexibleTree::new(vec![link], [0.0; 3])?;
    let mut q = vec![0.0; tree.len()];
    for stage in [0.5, 1.0] {
        let [force, moment] = [force, moment].map(|load| load.map(|entry| stage * entry));
        q = tree.equilibrium(&q, &[TipLoad { link: 0, force, moment }])?;
    }
    let mut workspace = tree.workspace();
    tree.terms(&q, &vec![0.0; tree.len()], &[], &mut workspace);
    let exact = workspace.tips[0].pose;
    let solved = |count: usize| -> Result<(Vector3<f64>, Vector3<f64>)> {
        let chain = TwoNodeChain::new(&section, 1.0, count)?;
        let mut x = chain.straight();
        for stage in (1..=20).map(|k| f64::from(k) / 20.0) {
            let [force, moment] = [force, moment].map(|load| load.map(|entry| stage * entry));
            x = chain.equilibrium(&x, &NodeLoad { force, moment })?;
        }
        let turn = rotation([3, 4, 5, 6].map(|k| tip(&x)[k]));
        Ok((gap(&x, exact.translation.to_array()), turn.columns[0] - exact.rotation.columns[0]))
    };
    let [coarse, middle, fine] = [solved(8)?, solved(16)?, solved(32)?];
    second_order([coarse.0, middle.0, fine.0], 1e-6);
    second_order([coarse.1, middle.1, fine.1], 1e-5);
    Ok(())
}

#[test]
fn chains_that_cannot_be_are_refused() -> Result<()> {
    assert!(matches!(TwoNodeChain::new(&slender()?, 1.0, 0), Err(Error::Setting { .. })));
    assert!(matches!(TwoNodeChain::new(&slender()?, -1.0, 4), Err(Error::Domain { .. })));
    let chain = TwoNodeChain::new(&slender()?, 1.0, 2)?;
    assert!(matches!(chain.equilibrium(&[0.0], &NodeLoad::default()), Err(Error::Dimension { .. })));
    Ok(())
}
