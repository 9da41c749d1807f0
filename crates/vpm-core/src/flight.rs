//! Flights of a link through a play, from contact to contact, along a motion that others make.

/// Acceleration of the link against the motor for each of the widths `gaps` (m or rad), impacts included: N x widths, row by row.
///
/// Law: within the gap the link accelerates by `pull` (m/s^2 or rad/s^2 against the motor, one per sample) and at the end of a step of
/// `interval` (s) is held between the two sides; where it arrives it stays, without speed, until the pull turns. The acceleration is the
/// second difference of its way, zero at the first and the last sample.
/// Source: the hard limit of the dead-zone model of Nordin & Gutman 2002, "Controlling mechanical systems with backlash - a survey",
/// Automatica 38(10), section 2, with plastic impacts.
/// Checked: against the same law one sample after the other for all widths together, in another language.
pub fn plastic_flights(pull: &[f64], gaps: &[f64], interval: f64) -> Vec<f64> {
    let (rows, widths) = (pull.len(), gaps.len());
    let (mut swing, mut way) = (vec![0.0; rows * widths], vec![0.0; rows]);
    for (number, gap) in gaps.iter().enumerate() {
        fly(pull, 0.5 * gap, interval, &mut way);
        for (k, at) in way.windows(3).enumerate() {
            swing[(k + 1) * widths + number] = (at[2] - 2.0 * at[1] + at[0]) / (interval * interval);
        }
    }
    swing
}

/// Writes the place at which the link begins each step.
fn fly(pull: &[f64], half: f64, interval: f64, way: &mut [f64]) {
    let (mut place, mut speed, mut side) = (0.0, 0.0, 0.0_f64);
    for (&acceleration, at) in pull.iter().zip(way) {
        *at = place;
        if side * acceleration > 0.0 {
            continue;
        }
        speed += interval * acceleration;
        let reached = place + interval * speed;
        place = held(reached, half);
        side = if reached == place { 0.0 } else { reached.signum() };
        if side != 0.0 {
            speed = 0.0;
        }
    }
}

/// Between both sides; what is no number stays none.
fn held(place: f64, half: f64) -> f64 {
    if place < -half {
        -half
    } else if place > half {
        half
    } else {
        place
    }
}
