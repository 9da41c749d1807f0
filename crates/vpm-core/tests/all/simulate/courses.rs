//! What inputs do between samples: the polynomials of each hold.

use vpm_core::simulate::Hold;

/// Value and slope of a course through samples of `law` at 0, 1, ..., `last`, at `share` of the interval from sample `k` on.
fn found(hold: Hold, (k, last): (usize, usize), share: f64, law: impl Fn(f64) -> f64) -> [f64; 2] {
    let course = hold.course(k, last, |sample| law(sample as f64));
    [course.at(share), course.slope(share)]
}

fn near(found: [f64; 2], wanted: [f64; 2]) -> bool {
    found.iter().zip(wanted).all(|(found, wanted)| (found - wanted).abs() < 1e-13)
}

#[test]
fn each_hold_follows_the_polynomials_of_its_order_to_the_ends_of_the_record() {
    let (line, parabola) = (|t: f64| 2.0 - 3.0 * t, |t: f64| 1.0 - 0.7 * t + 0.3 * t * t);
    for (k, share) in [(0, 0.25), (1, 0.5), (3, 0.9)] {
        let t = k as f64 + share;
        assert_eq!(found(Hold::ZeroOrder, (k, 4), share, parabola), [parabola(k as f64), 0.0]);
        assert!(near(found(Hold::FirstOrder, (k, 4), share, line), [line(t), -3.0]));
        assert!(near(found(Hold::Cubic, (k, 4), share, parabola), [parabola(t), 0.6 * t - 0.7]));
    }
}

#[test]
fn courses_meet_at_samples_and_the_last_goes_on_for_ever() {
    let law = |t: f64| (1.3 * t).sin();
    for k in 1..7 {
        assert!(near(found(Hold::Cubic, (k - 1, 8), 1.0, law), found(Hold::Cubic, (k, 8), 0.0, law)));
    }
    for hold in Hold::ALL {
        assert_eq!(found(hold, (8, 8), 0.5, law), [law(8.0), 0.0]);
        assert_eq!(found(hold, (0, 0), 0.5, law), [0.0, 0.0]);
    }
    assert!(near(found(Hold::Cubic, (0, 1), 0.5, law), found(Hold::FirstOrder, (0, 1), 0.5, law)));
}

#[test]
fn smooth_signals_are_met_to_the_third_order() {
    let worst = |count: usize| {
        let law = |sample: f64| (2.0 * sample / count as f64).cos();
        let off = |k: usize| found(Hold::Cubic, (k, count), 0.3, law)[0] - law(k as f64 + 0.3);
        (0..count).map(|k| off(k).abs()).fold(0.0, f64::max)
    };
    let order = (worst(20) / worst(40)).log2();
    assert!((2.8..4.2).contains(&order), "{order}");
}
