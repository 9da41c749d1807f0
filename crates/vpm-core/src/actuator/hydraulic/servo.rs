//! A servo-cylinder with a load of one mass, as an ordinary differential equation of its own.

use serde::Deserialize;

use super::{Chambers, Cylinder, Flows, Fluid, NamedDomain, PistonSize, Valve};
use crate::effect::Domain;
use crate::error::{Error, Result};
use crate::ode::Ode;
use crate::scalar::{Dual, Scalar};

/// How many numbers the state has.
const STATES: usize = 6;

/// Mass on the rod, between a spring and a damper.
///
/// Law: `m a = F - damping v - stiffness x - f`, N, with the force F of the cylinder and a force f against it.
/// Source: D'Imperio 2016, section 4.1. Checked: the mass is positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load<P> {
    /// Mass of piston, rod and load, kg.
    pub mass: P,
    /// Damping, N s/m.
    pub damping: P,
    /// Stiffness of a spring that is at rest at mid-stroke, N/m.
    pub stiffness: P,
}

/// State of a servo-cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoState<S> {
    /// Place of the piston from mid-stroke, m.
    pub position: S,
    /// Place of the spool, spool unit.
    pub spool: S,
    /// Velocity of the piston, m/s.
    pub velocity: S,
    /// Rate of the spool, spool unit/s.
    pub spool_rate: S,
    /// State of both chambers, Pa: the pressure while it is above that of vapour, see [`Fluid`].
    pub chambers: Chambers<S>,
}

impl<S: Copy> ServoState<S> {
    /// Servo-cylinder state as numbers: position, spool, velocity, spool rate, chamber a, chamber b.
    #[inline]
    pub fn to_array(self) -> [S; STATES] {
        [self.position, self.spool, self.velocity, self.spool_rate, self.chambers.a, self.chambers.b]
    }

    /// Servo-cylinder state of these numbers.
    #[inline]
    pub fn from_array([position, spool, velocity, spool_rate, a, b]: [S; STATES]) -> Self {
        Self { position, spool, velocity, spool_rate, chambers: Chambers { a, b } }
    }
}

/// A cylinder behind a servovalve between supply and tank, moving a load.
///
/// Law: that of its parts. Source: D'Imperio 2016, section 4.1 and appendix A. Checked: see each part; pressures are positive.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoCylinder<P> {
    /// The oil.
    pub fluid: Fluid<P>,
    /// The valve.
    pub valve: Valve<P>,
    /// The cylinder.
    pub cylinder: Cylinder<P>,
    /// What it moves.
    pub load: Load<P>,
    /// Pressure of the supply, Pa.
    pub supply_pressure: P,
    /// Pressure of the tank, Pa.
    pub tank_pressure: P,
}

impl<P> ServoCylinder<P> {
    /// The same servo-cylinder over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> ServoCylinder<T> {
        ServoCylinder {
            fluid: self.fluid.map(f),
            valve: self.valve.map(f),
            cylinder: self.cylinder.map(f),
            load: Load { mass: f(&self.load.mass), damping: f(&self.load.damping), stiffness: f(&self.load.stiffness) },
            supply_pressure: f(&self.supply_pressure),
            tank_pressure: f(&self.tank_pressure),
        }
    }

    /// Parameters of the servo-cylinder and where each is defined.
    pub fn domains(&self) -> Vec<NamedDomain<'_, P>> {
        let own = [
            ("load.mass", &self.load.mass, Domain::Positive),
            ("load.damping", &self.load.damping, Domain::Any),
            ("load.stiffness", &self.load.stiffness, Domain::Any),
            ("supply_pressure", &self.supply_pressure, Domain::Positive),
            ("tank_pressure", &self.tank_pressure, Domain::Positive),
        ];
        [self.fluid.domains(), self.valve.domains(), self.cylinder.domains(), own.to_vec()].concat()
    }
}

impl<S: Scalar> ServoCylinder<S> {
    /// Servo-cylinder state at rest at mid-stroke, no force on the load: `A pa = alpha A pb`, `pa + pb = ps + pt`. The
    /// spool is in the middle.
    pub fn rest(&self) -> ServoState<S> {
        let zero = S::zero();
        let chambers = self.cylinder.rest(self.supply_pressure, self.tank_pressure);
        ServoState { position: zero, spool: zero, velocity: zero, spool_rate: zero, chambers }
    }

    /// Chamber pressures of the servo-cylinder in Pa.
    #[inline]
    pub fn pressures(&self, state: &ServoState<S>) -> Chambers<S> {
        Chambers { a: self.fluid.pressure(state.chambers.a), b: self.fluid.pressure(state.chambers.b) }
    }

    /// Flows through the servo-cylinder's valve.
    #[inline]
    pub fn flows(&self, state: &ServoState<S>) -> Flows<S> {
        let Chambers { a, b } = self.pressures(state);
        self.valve.flows(state.spool, self.supply_pressure, self.tank_pressure, [a, b])
    }

    /// Rate of the servo-cylinder's state under a `current` (A) in the valve and a `force` (N) against the rod.
    #[inline]
    pub fn rates(&self, state: &ServoState<S>, current: S, force: S) -> ServoState<S> {
        let (x, v, load) = (state.position, state.velocity, &self.load);
        let (pressures, flows) = (self.pressures(state), self.flows(state));
        let inflow = Chambers { a: flows.into_a, b: -flows.out_of_b };
        let driven = self.cylinder.force(pressures) + self.cylinder.resistance(x, v, pressures);
        ServoState {
            position: v,
            spool: state.spool_rate,
            velocity: (driven - load.damping * v - load.stiffness * x - force) / load.mass,
            spool_rate: self.valve.spool_acceleration(state.spool, state.spool_rate, current).unwrap_or_else(S::zero),
            chambers: self.cylinder.rates(&self.fluid, state.chambers, [x, v], inflow, self.tank_pressure),
        }
    }
}

/// A servo-cylinder whose current and force are held, for any integrator.
///
/// State: see [`ServoState::to_array`]; two second-order coordinates (piston and spool) lead it, the chambers follow.
#[derive(Clone, Debug)]
pub struct ServoRig<S> {
    servo: ServoCylinder<S>,
    lifted: ServoCylinder<Dual<S, STATES>>,
    /// Current in the valve, A.
    pub current: S,
    /// Force against the rod, N.
    pub force: S,
}

impl<S: Scalar> ServoRig<S> {
    /// Servo rig without current and force, if its parameters have a meaning.
    pub fn new(servo: ServoCylinder<S>) -> Result<Self> {
        for (name, parameter, domain) in servo.domains() {
            let value = parameter.inspect();
            if !domain.contains(value) {
                return Err(Error::Domain { path: name.to_owned(), condition: domain.condition(), value });
            }
        }
        if servo.valve.frequency.is_none() {
            let (condition, repair) = ("be that of a spool with a motion of its own".to_owned(), "give its frequency");
            return Err(Error::Setting { setting: "the spool of a rig", condition, value: 0.0, repair });
        }
        if let PistonSize::Diameters { bore, rod } = servo.cylinder.size
            && rod.inspect() >= bore.inspect()
        {
            let condition = format!("be below the bore, {} m", bore.inspect());
            let (value, repair) = (rod.inspect(), "give both as diameters in m");
            return Err(Error::Setting { setting: "the diameter of a cylinder's rod", condition, value, repair });
        }
        let lifted = servo.map(&mut |&parameter| Dual::constant(parameter));
        Ok(Self { servo, lifted, current: S::zero(), force: S::zero() })
    }

    /// The servo-cylinder of the rig.
    pub fn servo(&self) -> &ServoCylinder<S> {
        &self.servo
    }
}

/// Servo-cylinder state at the front of `x`; the integrators see to it that there is one.
#[inline]
fn read<S: Scalar, T: Scalar>(x: &[S], lift: impl Fn(S, usize) -> T) -> ServoState<T> {
    ServoState::from_array(std::array::from_fn(|k| lift(x.get(k).copied().unwrap_or_default(), k)))
}

impl<S: Scalar> Ode<S> for ServoRig<S> {
    fn dim(&self) -> usize {
        STATES
    }

    fn coordinates(&self) -> usize {
        2
    }

    fn rhs(&mut self, x: &[S], dxdt: &mut [S]) {
        let state = read(x, |number, _| number);
        dxdt.copy_from_slice(&self.servo.rates(&state, self.current, self.force).to_array());
    }

    fn jacobian(&mut self, x: &[S], jacobian: &mut [S]) {
        let state = read(x, Dual::<S, STATES>::variable);
        let (current, force) = (Dual::constant(self.current), Dual::constant(self.force));
        let rates = self.lifted.rates(&state, current, force).to_array();
        for (row, rate) in jacobian.chunks_exact_mut(STATES).zip(rates) {
            row.copy_from_slice(&rate.gradient);
        }
    }

    /// Scales of the servo-cylinder's states. Position 1 cm, velocity 1 m/s, the stroke of the spool and its rate at
    /// the natural frequency, pressures 1 bar.
    fn scales(&self, scales: &mut [f64]) {
        let (spool, frequency) =
            (self.servo.valve.stroke.inspect(), self.servo.valve.frequency.map_or(1.0, |own| own.inspect()));
        scales.copy_from_slice(&[1e-2, spool, 1.0, spool * frequency, 1e5, 1e5]);
    }
}
