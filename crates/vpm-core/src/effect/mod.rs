//! Physical effects, one per file: what a real joint or body does beyond the ideal rigid tree.
//!
//! An effect is a plain struct over its number type `P`: with `P = usize` it is a description (indices into the flat parameter
//! vector), with `P: Scalar` it is the law itself, numbers in, effort out. `map` goes from one to the other.

mod asymmetric_friction;
mod backlash;
mod bias_force;
mod coulomb_friction;
mod cubic_spring;
mod current_ripple;
mod domain;
mod empirical_force;
mod end_stop;
mod formula;
mod hysteresis;
mod joint_compliance;
mod law;
mod link_flexibility;
mod load_dependent_friction;
mod lugre_friction;
mod payload;
mod position_dependent_friction;
mod quadratic_drag;
mod seat;
mod spring;
mod stribeck_friction;
mod torque_ripple;
mod viscous_friction;
mod warming_friction;

pub use asymmetric_friction::AsymmetricFriction;
pub use backlash::Backlash;
pub use bias_force::BiasForce;
pub use coulomb_friction::CoulombFriction;
pub use cubic_spring::CubicSpring;
pub use current_ripple::CurrentRipple;
pub use domain::Domain;
pub use empirical_force::EmpiricalForce;
pub use end_stop::EndStop;
pub use formula::{Formula, Instruction};
pub use hysteresis::Hysteresis;
pub use joint_compliance::JointCompliance;
pub use law::{Law, MemoryChords, MemoryLaw};
pub use link_flexibility::LinkFlexibility;
pub use load_dependent_friction::LoadDependentFriction;
pub use lugre_friction::LugreFriction;
pub use payload::Payload;
pub use position_dependent_friction::PositionDependentFriction;
pub use quadratic_drag::QuadraticDrag;
pub(crate) use seat::Place;
pub use seat::Seat;
pub use spring::Spring;
pub use stribeck_friction::StribeckFriction;
pub use torque_ripple::TorqueRipple;
pub use viscous_friction::ViscousFriction;
pub use warming_friction::WarmingFriction;

use crate::scalar::{Dual, Scalar};
use law::{family, law, within_largest};

family! {
    /// Any effect that puts an effort on a joint as a function of its coordinate and velocity.
    JointEffect: Law {
        /// A sum of terms that a fit chose.
        EmpiricalForce,
        /// Resistance proportional to speed.
        ViscousFriction,
        /// Constant resistance against the motion.
        CoulombFriction,
        /// Friction that differs between the directions.
        AsymmetricFriction,
        /// Extra friction at low speed.
        StribeckFriction,
        /// Dry friction that changes along the way.
        PositionDependentFriction,
        /// Dry friction in proportion to the load.
        LoadDependentFriction,
        /// Resistance proportional to the square of the speed.
        QuadraticDrag,
        /// Constant load.
        BiasForce,
        /// Linear spring.
        Spring,
        /// Spring with the cube of the way.
        CubicSpring,
        /// Effort periodic in the coordinate.
        TorqueRipple,
        /// Share of the drive's effort, periodic in the coordinate.
        CurrentRipple,
        /// Spring with a dead band.
        Backlash,
        /// Wind-up of a drive.
        JointCompliance,
        /// Bending of a link, lumped at its root.
        LinkFlexibility,
        /// Ends of the way.
        EndStop,
        /// Law that a user wrote.
        Formula,
    }
}

family! {
    /// Any effect that puts an effort on a joint as a function of its velocity and of a memory.
    MemoryEffect: MemoryLaw {
        /// Between a spring for short ways and dry friction for long ones.
        Hysteresis,
        /// Bristles that bend and slide.
        LugreFriction,
        /// Friction that a machine loses as it gets warm.
        WarmingFriction,
    }
}

impl<S: Scalar> JointEffect<S> {
    /// Slope of an effect's effort at rest by the coordinate, N/m or N m/rad.
    #[inline]
    pub fn slope_at_rest(&self, q: S) -> S {
        let lifted = self.map(&mut |&parameter| Dual::<S, 1>::constant(parameter));
        lifted.law().effort_at_rest(Dual::variable(q, 0)).gradient[0]
    }
}

/// Function tanh(x)/x of effects, smooth through x = 0.
#[inline]
fn tanh_ratio<S: Scalar>(x: S) -> S {
    // The series 1 - x^2/3 + 2 x^4/15 ...: what is left out is below rounding.
    x.abs().if_less(S::from_f64(1e-4), || -(x * x / 3.0) + 1.0, || x.tanh() / x)
}
