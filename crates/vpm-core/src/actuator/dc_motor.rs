//! A direct-current motor behind a gear: the voltage drives a current, the current a torque.

use serde::Deserialize;

use crate::effect::CoulombFriction;
use crate::effect::Domain;
use crate::effect::Law;
use crate::scalar::Scalar;

/// Motor with permanent magnets, or a servo motor seen along its torque axis, behind a gear with losses. The command is a voltage.
///
/// Law: `tau_e di/dt = (u - k_e N dq) / R - i` and `tau = N k_t i - (1 - eta) |N k_t i| tanh(dq / v_t)`, with the current i in A, the
/// voltage u in V, the rate of the joint dq in rad/s, the effort tau on it in N m. `tau_e = L / R` is the electrical time constant, so
/// that the magnetic field holds `tau_e R i^2 / 2`. The gear's loss grows with its load: of the power of a motor that drives the share eta
/// arrives, and a joint that is driven back has to overcome `2 - eta` of the motor's torque. The rotor's inertia J adds `N^2 J` to that of
/// the joint; it stands in the mass matrix, not in this law. At a rate that is held, the current after a time h is
/// `i_s + (i - i_s) e^(-h / tau_e)` with `i_s = (u - k_e N dq) / R`.
/// Source: the electric drive, Siciliano, Sciavicco, Villani & Oriolo 2009, "Robotics", section 5.2.1; its gear, section 5.2.3; friction
/// that grows with the load, Hamon, Gautier & Garrec 2010, "Dynamic identification of robots with a dry friction model depending on load
/// and velocity", IEEE/RSJ IROS.
/// Checked: resistance, time constant, gear's transition velocity positive, efficiency and inertia not negative.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DcMotor<P> {
    /// R, of the armature, Ohm.
    pub resistance: P,
    /// `tau_e`, inductance by resistance, s.
    pub time_constant: P,
    /// `k_t`, torque of the rotor per current, N m/A.
    pub torque_constant: P,
    /// `k_e`, voltage per rate of the rotor, V s/rad; the same number as the torque constant where no power is lost between the two.
    pub back_emf: P,
    /// N, turns of the rotor per turn of the joint.
    pub gear_ratio: P,
    /// eta, share of the torque that the gear hands on when the motor drives.
    pub efficiency: P,
    /// `v_t`, rate of the joint at which tanh(1) = 76 % of the gear's loss are there, rad/s.
    pub transition_velocity: P,
    /// J of the rotor about its axis, kg m^2.
    #[serde(default = "none")]
    pub rotor_inertia: Option<P>,
}

fn none<T>() -> Option<T> {
    None
}

impl<P> DcMotor<P> {
    /// The same motor over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> DcMotor<T> {
        DcMotor {
            resistance: f(&self.resistance),
            time_constant: f(&self.time_constant),
            torque_constant: f(&self.torque_constant),
            back_emf: f(&self.back_emf),
            gear_ratio: f(&self.gear_ratio),
            efficiency: f(&self.efficiency),
            transition_velocity: f(&self.transition_velocity),
            rotor_inertia: self.rotor_inertia.as_ref().map(f),
        }
    }

    /// Parameters of the motor and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let mut domains = vec![
            (&self.resistance, Domain::Positive),
            (&self.time_constant, Domain::Positive),
            (&self.torque_constant, Domain::Any),
            (&self.back_emf, Domain::Any),
            (&self.gear_ratio, Domain::NonZero),
            (&self.efficiency, Domain::NonNegative),
            (&self.transition_velocity, Domain::Positive),
        ];
        domains.extend(self.rotor_inertia.as_ref().map(|inertia| (inertia, Domain::NonNegative)));
        domains
    }
}

impl<S: Scalar> DcMotor<S> {
    /// Effort of the motor on the joint in N m at `current` (A), the joint turning with `rate` (rad/s).
    #[inline]
    pub fn effort(&self, current: S, rate: S) -> S {
        let driving = self.driving(current);
        driving - (S::one() - self.efficiency) * driving.abs() * (rate / self.transition_velocity).tanh()
    }

    /// Torque of the motor on the joint in N m before the gear takes its share.
    #[inline]
    pub fn driving(&self, current: S) -> S {
        self.gear_ratio * self.torque_constant * current
    }

    /// Resistance of the gear in N m s/rad at `rate` (rad/s), the chord from rest, where the motor gives `driving` (N m) to the joint.
    #[inline]
    pub fn gear_resistance(&self, driving: S, rate: S) -> S {
        let coulomb = (S::one() - self.efficiency) * driving.abs();
        CoulombFriction { coulomb, transition_velocity: self.transition_velocity }.resistance(S::zero(), rate)
    }

    /// Motor current rate di/dt in A/s at `current` (A) under `voltage` (V), the joint turning with `rate` (rad/s).
    #[inline]
    pub fn current_rate(&self, current: S, voltage: S, rate: S) -> S {
        (self.settled(voltage, rate) - current) / self.time_constant
    }

    /// Settled motor current in A under `voltage` (V) at `rate` (rad/s) of the joint.
    #[inline]
    pub fn settled(&self, voltage: S, rate: S) -> S {
        (voltage - self.back_emf * self.gear_ratio * rate) / self.resistance
    }

    /// Inertia `N^2 J` in kg m^2 that the motor's rotor adds to the joint.
    #[inline]
    pub fn reflected_inertia(&self) -> S {
        self.rotor_inertia.map_or(S::zero(), |inertia| self.gear_ratio * self.gear_ratio * inertia)
    }

    /// Energy of the motor's magnetic field in J at `current` (A): `tau_e R i^2 / 2`.
    #[inline]
    pub fn magnetic(&self, current: S) -> S {
        self.time_constant * self.resistance * current * current * 0.5
    }

    /// Losses of the motor in W at `current` (A) and `rate` (rad/s) of the joint: in copper and gear.
    #[inline]
    pub fn losses(&self, current: S, rate: S) -> (S, S) {
        let driving = self.driving(current);
        (self.resistance * current * current, (driving - self.effort(current, rate)) * rate)
    }
}
