//! Flights of a link through a play, from one soft contact to the other, along a motion that others make.

/// A play between soft contacts.
#[derive(Clone, Copy, Debug)]
pub struct SoftPlay {
    /// Free way from contact to contact, m or rad.
    pub gap: f64,
    /// Rate at which the link swings on a contact while the motor stands, rad/s.
    pub rate: f64,
    /// Damping ratio there.
    pub damping: f64,
}

/// Flights through backlashes: acceleration of the link against the motor for each. N x backlashes, row by row.
///
/// Law: `y'' = pull` within the gap and `y'' = pull - w^2 (y -+ gap/2) - 2 z w y'` beyond it, `pull` in m/s^2 or rad/s^2 against the
/// motor, one per sample, `w` the rate and z the damping ratio. Steps of `interval` (s) take the damping at the new velocity and the
/// place with it; they are stable up to `w interval = 2`.
/// Source: dead-zone model of Nordin & Gutman 2002, "Controlling mechanical systems with backlash - a survey", Automatica 38(10),
/// section 2, with the damping of its shaft in contact.
/// Checked: against the same law one sample after the other for all plays together, in another language.
pub fn soft_flights(pull: &[f64], plays: &[SoftPlay], interval: f64) -> Vec<f64> {
    let mut swing = vec![0.0; pull.len() * plays.len()];
    for (number, play) in plays.iter().enumerate() {
        let half = 0.5 * play.gap;
        let spring = interval * play.rate * play.rate;
        let kept = 1.0 / (1.0 + 2.0 * interval * play.damping * play.rate);
        let (mut place, mut speed) = (0.0_f64, 0.0_f64);
        for (&acceleration, row) in pull.iter().zip(swing.chunks_exact_mut(plays.len())) {
            let beyond = beyond(place, half);
            let free = speed + interval * acceleration - spring * beyond;
            let next = if beyond == 0.0 { free } else { kept * free };
            row[number] = (next - speed) / interval;
            place += interval * next;
            speed = next;
        }
    }
    swing
}

/// Way of a flight beyond the backlash; what is no number stays none.
fn beyond(place: f64, half: f64) -> f64 {
    if place < -half {
        place + half
    } else if place > half {
        place - half
    } else {
        0.0 * place
    }
}
