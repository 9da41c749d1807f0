//! The published servo-cylinder, and its motion under a current that is a function of time.

use vpm_core::actuator::DeadZone;
use vpm_core::actuator::hydraulic::{
    Cylinder, EndStop, Fluid, Load, Orifice, PistonSize, SealFriction, ServoCylinder, ServoState, Valve,
};
use vpm_core::ode::Ode;
use vpm_core::{Dual, Scalar};

/// Nominal parameters of D'Imperio 2016, chapter 4, completed from the data sheets of cylinder and valve; the spool counts in A.
pub fn nominal() -> ServoCylinder<f64> {
    let gain = Orifice::rated_gain(7.5 / 60e3, 35e5, 0.01);
    let cylinder = Cylinder {
        size: PistonSize::Diameters { bore: 0.016, rod: 0.010 },
        stroke: 0.080,
        line_a: 2.9e-6,
        line_b: 2.9e-6,
        internal_leakage: 1.7e-13,
        worn_leakage: None,
        external_leakage: 0.0,
        stop: EndStop { stiffness: 5e8, damping: 2e4 },
        seal: SealFriction { viscous: None, coulomb: None, stribeck: None, pressed: None },
    };
    ServoCylinder {
        fluid: Fluid { bulk_modulus: 1.2e9, vapour_pressure: 1e3, air: None, more_air: None },
        valve: Valve {
            gain: 1.0,
            frequency: Some(std::f64::consts::TAU * 250.0),
            damping: Some(0.7),
            delay: None,
            stroke: 0.01,
            overlap: DeadZone { width: 0.0 },
            clearance: None,
            orifice: Orifice { gain, transition_pressure: 1e4 },
        },
        cylinder,
        load: Load { mass: 3.0, damping: 700.0, stiffness: 589.927 },
        supply_pressure: 16e6,
        tank_pressure: 1e5,
    }
}

/// A sine whose phase is `(start + slope t) t` (rad/s, rad/s^2).
#[derive(Clone, Copy, Debug)]
pub struct Chirp {
    pub amplitude: f64,
    pub start: f64,
    pub slope: f64,
}

impl Chirp {
    pub fn current<S: Scalar>(&self, t: S) -> S {
        ((t * self.slope + self.start) * t).sin() * self.amplitude
    }
}

/// The servo-cylinder with the time as the last state.
#[derive(Clone, Debug)]
pub struct Chirped {
    servo: ServoCylinder<f64>,
    lifted: ServoCylinder<Dual<f64, 7>>,
    chirp: Chirp,
}

impl Chirped {
    pub fn new(servo: ServoCylinder<f64>, chirp: Chirp) -> Self {
        Self { servo, lifted: servo.map(&mut |&number| Dual::constant(number)), chirp }
    }

    /// The state at rest, at time 0.
    pub fn rest(&self) -> [f64; 7] {
        let [x, z, v, w, a, b] = self.servo.rest().to_array();
        [x, z, v, w, a, b, 0.0]
    }

    fn rates<S: Scalar>(&self, servo: &ServoCylinder<S>, [x, z, v, w, a, b, t]: [S; 7]) -> [S; 7] {
        let state = ServoState::from_array([x, z, v, w, a, b]);
        let [x, z, v, w, a, b] = servo.rates(&state, self.chirp.current(t), S::zero()).to_array();
        [x, z, v, w, a, b, S::one()]
    }
}

impl Ode<f64> for Chirped {
    fn dim(&self) -> usize {
        7
    }
    fn coordinates(&self) -> usize {
        2
    }
    fn rhs(&mut self, x: &[f64], dxdt: &mut [f64]) {
        dxdt.copy_from_slice(&self.rates(&self.servo, std::array::from_fn(|k| x[k])));
    }
    fn jacobian(&mut self, x: &[f64], jacobian: &mut [f64]) {
        let rates = self.rates(&self.lifted, std::array::from_fn(|k| Dual::variable(x[k], k)));
        for (row, rate) in jacobian.chunks_exact_mut(7).zip(rates) {
            row.copy_from_slice(&rate.gradient);
        }
    }
    fn scales(&self, scales: &mut [f64]) {
        let (spool, frequency) = (self.servo.valve.stroke, self.servo.valve.frequency.unwrap_or_default());
        scales.copy_from_slice(&[1e-2, spool, 1.0, spool * frequency, 1e5, 1e5, 1.0]);
    }
}
