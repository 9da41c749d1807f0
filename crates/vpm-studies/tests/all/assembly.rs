//! Closed linkages: singular arrangements are found where they are, and what cannot be assembled is said with its numbers.

use vpm_core::Scalar;
use vpm_studies::linkage::karl::{Karl, KarlGeometry, KarlPose};
use vpm_studies::linkage::{ClosedLinkage, Newton, Slider, StrokeGeometry, StrokeLinkage};
use vpm_studies::{Error, Result};

#[test]
fn a_short_rod_folds_on_the_near_side_of_the_axis() {
    let geometry =
        StrokeGeometry { slider: Slider::OnFrame, start: [0.0; 2], direction: 0.0, anchor: [0.0, 0.3], rod: 0.1 };
    let linkage = StrokeLinkage::new("short", geometry).unwrap();
    let [far, _, near, _] = linkage.alignments()[..] else { panic!("four alignments") };
    // The slider moves along a line through the axis: the arm points at it at both ends, and never gets far from it.
    assert!((far.stroke - 0.4).abs() < 1e-15 && (near.stroke - 0.2).abs() < 1e-15);
    assert!([far, near].iter().all(|at| linkage.constraint(at.stroke, at.angle).abs() < 1e-16));
    assert_eq!(linkage.span(&far, &near, 1.0), 0.0);
}

#[test]
fn a_rod_across_the_stroke_is_the_inverse_singularity() {
    // A rod of 0.15 m reaches the line y = 0.1 m from the arm of 0.2 m up to |0.1 - 0.2 sin q| = 0.15 m.
    let (limit, reach) = (0.25_f64.asin(), 0.2 * (1.0 - 0.0625_f64).sqrt());
    for (slider, angle) in [(Slider::OnFrame, -limit), (Slider::OnRocker, limit)] {
        let geometry = StrokeGeometry { slider, start: [-0.3, 0.1], direction: 0.0, anchor: [0.2, 0.0], rod: 0.15 };
        let linkage = StrokeLinkage::new("short", geometry).unwrap();
        let stroke = 0.3 + reach;
        assert!(linkage.constraint(stroke, angle).abs() < 1e-16);
        assert!(linkage.stroke_slope(stroke, angle).abs() < 1e-15 && linkage.ratio(stroke, angle).abs() < 1e-13);
        assert!(linkage.determinant(stroke, angle).abs() > 1e-3);
        let [large, small] = linkage.strokes(0.9 * angle).unwrap();
        assert!(large > stroke + 0.01 && small < stroke - 0.01);
        let text = linkage.strokes(1.1 * angle).unwrap_err().to_string();
        assert!(text.contains("angle (rad)") && text.contains("0.15 m; choose"), "{text}");
    }
}

#[test]
fn every_inverse_singularity_is_found() {
    for slider in [Slider::OnFrame, Slider::OnRocker] {
        for (anchor, rod, count) in [([0.2, 0.0], 0.15, 2), ([0.1, -0.35], 0.15, 4), ([0.03, 0.02], 0.25, 0)] {
            let geometry = StrokeGeometry { slider, start: [-0.3, 0.1], direction: 0.2, anchor, rod };
            let linkage = StrokeLinkage::new("any", geometry).unwrap();
            let found = linkage.perpendiculars();
            assert_eq!(found.len(), count, "{slider:?} {anchor:?}");
            for at in &found {
                assert!(linkage.constraint(at.stroke, at.angle).abs() < 1e-15);
                assert!(linkage.stroke_slope(at.stroke, at.angle).abs() < 1e-15);
                // Both strokes of an angle close by, on the side that can be assembled, lie around the singular one.
                let near = [1e-6, -1e-6].iter().filter_map(|off| linkage.strokes(at.angle + off).ok());
                let pairs: Vec<[f64; 2]> = near.collect();
                assert!(pairs.len() == 1 && pairs[0][0] > at.stroke && pairs[0][1] < at.stroke, "{pairs:?}");
            }
        }
    }
    let karl = Karl::new(KarlGeometry::default()).unwrap();
    assert!(karl.linkages().iter().all(|linkage| linkage.perpendiculars().is_empty()), "rods outreach the arms");
}

/// A linkage that cannot be closed: x^2 + 1 = 0.
struct Open;

impl ClosedLinkage<1, 1> for Open {
    fn name(&self) -> &str {
        "open"
    }
    fn constraints<S: Scalar>(&self, [q]: &[S; 1], [u]: &[S; 1]) -> [S; 1] {
        [*q * *q + *u]
    }
}

#[test]
fn newton_stops_in_bounded_time_and_says_why() -> Result<()> {
    let newton = Newton { max_iterations: 7, ..Newton::default() };
    let text = newton.solve(&Open, [0.3], &[1.0]).unwrap_err().to_string();
    assert!(
        text.contains("`open`") && text.contains("after 7 Newton steps") && text.contains("start nearer"),
        "{text}"
    );
    let text = newton.solve(&Open, [0.0], &[1.0]).unwrap_err().to_string();
    assert!(text.contains("singular at coordinates [0.0]"), "{text}");
    assert!(matches!(newton.solve(&Open, [f64::NAN], &[1.0]), Err(Error::Core(vpm_core::Error::NonFinite { .. }))));
    let zero = Newton { tolerance: 0.0, ..newton };
    assert!(zero.solve(&Open, [1.0], &[1.0]).unwrap_err().to_string().contains("must be positive, got 0"));
    // Quadratic convergence: from 1e-2 off, four steps reach rounding.
    assert!(newton.solve(&Open, [1.01], &[-1.0])?.iterations <= 4);
    Ok(())
}

#[test]
fn what_cannot_be_assembled_is_said_with_its_numbers() {
    let karl = Karl::new(KarlGeometry::default()).unwrap();
    let text = karl.direct([0.30, 0.18]).unwrap_err().to_string();
    assert!(
        text.starts_with("linkage `karl.first` cannot be assembled at stroke (m) = 0.3: its ends are 0.316"),
        "{text}"
    );
    assert!(text.contains("reach from 0.19 m to 0.27 m"), "{text}");
    assert!(karl.linkages()[0].angles_by_resultant(0.30).is_err());
    let text = karl.inverse([0.7, 0.0]).unwrap_err().to_string();
    assert!(text.contains("distance of the end point (m) = 0.7") && text.contains("0.604"), "{text}");
    let broken = KarlGeometry { rods: [0.23, -0.1], ..KarlGeometry::default() };
    assert!(Karl::new(broken).unwrap_err().to_string().starts_with("`karl.second.rod` must be positive, got -0.1"));
    let flat = StrokeGeometry {
        slider: Slider::OnFrame,
        start: [0.0, f64::NAN],
        direction: 0.0,
        anchor: [1.0, 0.0],
        rod: 1.0,
    };
    assert!(matches!(StrokeLinkage::new("flat", flat), Err(vpm_core::Error::NonFinite { .. })));
    // With rod and arm of one length, a slider on the axis leaves the angle free.
    let equal = StrokeGeometry { start: [0.0; 2], ..flat };
    let text = StrokeLinkage::new("equal", equal).unwrap().angles(0.0).unwrap_err().to_string();
    assert!(text.starts_with("linkage `equal` is singular at coordinates [0.0]"), "{text}");
    let pose = KarlPose { angles: [0.2, 0.0], strokes: [0.2, 0.2] };
    assert_eq!(karl.end_point_determinant(pose.angles), 0.0);
}
