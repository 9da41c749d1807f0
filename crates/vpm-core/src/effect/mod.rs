//! Physical effects, one per file: what a real joint or body does beyond the ideal rigid tree.
//!
//! An effect is a plain struct over its number type `P`: with `P = usize` it is a description (indices into the flat parameter
//! vector), with `P: Scalar` it is the law itself, numbers in, effort out. `map` goes from one to the other.

mod asymmetric_friction;
mod backlash;
mod bias_force;
mod coulomb_friction;
mod domain;
mod empirical_force;
mod end_stop;
mod formula;
mod hysteresis;
mod joint_compliance;
mod link_flexibility;
mod payload;
mod seat;
mod spring;
mod stribeck_friction;
mod torque_ripple;
mod viscous_friction;

use serde::Deserialize;

pub use asymmetric_friction::AsymmetricFriction;
pub use backlash::Backlash;
pub use bias_force::BiasForce;
pub use coulomb_friction::CoulombFriction;
pub use domain::Domain;
pub use empirical_force::EmpiricalForce;
pub use end_stop::EndStop;
pub use formula::{Formula, Instruction};
pub use hysteresis::Hysteresis;
pub use joint_compliance::JointCompliance;
pub use link_flexibility::LinkFlexibility;
pub use payload::Payload;
pub use seat::Seat;
pub use spring::Spring;
pub use stribeck_friction::StribeckFriction;
pub use torque_ripple::TorqueRipple;
pub use viscous_friction::ViscousFriction;

use crate::scalar::{Dual, Scalar};

/// Any effect that puts an effort on a joint as a function of its coordinate and velocity.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum JointEffect<P> {
    /// A sum of terms that a fit chose.
    EmpiricalForce(EmpiricalForce<P>),
    /// Resistance proportional to speed.
    ViscousFriction(ViscousFriction<P>),
    /// Constant resistance against the motion.
    CoulombFriction(CoulombFriction<P>),
    /// Friction that differs between the directions.
    AsymmetricFriction(AsymmetricFriction<P>),
    /// Extra friction at low speed.
    StribeckFriction(StribeckFriction<P>),
    /// Constant load.
    BiasForce(BiasForce<P>),
    /// Linear spring.
    Spring(Spring<P>),
    /// Effort periodic in the coordinate.
    TorqueRipple(TorqueRipple<P>),
    /// Spring with a dead band.
    Backlash(Backlash<P>),
    /// Wind-up of a drive.
    JointCompliance(JointCompliance<P>),
    /// Bending of a link, lumped at its root.
    LinkFlexibility(LinkFlexibility<P>),
    /// Ends of the way.
    EndStop(EndStop<P>),
    /// Law that a user wrote.
    Formula(Formula<P>),
}

impl<P> JointEffect<P> {
    /// The same effect over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> JointEffect<T> {
        match self {
            Self::EmpiricalForce(law) => JointEffect::EmpiricalForce(law.map(f)),
            Self::ViscousFriction(law) => JointEffect::ViscousFriction(law.map(f)),
            Self::CoulombFriction(law) => JointEffect::CoulombFriction(law.map(f)),
            Self::AsymmetricFriction(law) => JointEffect::AsymmetricFriction(law.map(f)),
            Self::StribeckFriction(law) => JointEffect::StribeckFriction(law.map(f)),
            Self::BiasForce(law) => JointEffect::BiasForce(law.map(f)),
            Self::Spring(law) => JointEffect::Spring(law.map(f)),
            Self::TorqueRipple(law) => JointEffect::TorqueRipple(law.map(f)),
            Self::Backlash(law) => JointEffect::Backlash(law.map(f)),
            Self::JointCompliance(law) => JointEffect::JointCompliance(law.map(f)),
            Self::LinkFlexibility(law) => JointEffect::LinkFlexibility(law.map(f)),
            Self::EndStop(law) => JointEffect::EndStop(law.map(f)),
            Self::Formula(law) => JointEffect::Formula(law.map(f)),
        }
    }

    /// The parameters and where each is defined.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        match self {
            Self::EmpiricalForce(law) => law.domains(),
            Self::ViscousFriction(law) => law.domains(),
            Self::CoulombFriction(law) => law.domains(),
            Self::AsymmetricFriction(law) => law.domains(),
            Self::StribeckFriction(law) => law.domains(),
            Self::BiasForce(law) => law.domains(),
            Self::Spring(law) => law.domains(),
            Self::TorqueRipple(law) => law.domains(),
            Self::Backlash(law) => law.domains(),
            Self::JointCompliance(law) => law.domains(),
            Self::LinkFlexibility(law) => law.domains(),
            Self::EndStop(law) => law.domains(),
            Self::Formula(law) => law.domains(),
        }
    }
}

impl<S: Scalar> JointEffect<S> {
    /// Effort on the joint, N or N m, at coordinate `q` (m or rad) and velocity `v` (m/s or rad/s).
    #[inline]
    pub fn effort(&self, q: S, v: S) -> S {
        match self {
            Self::EmpiricalForce(law) => law.effort(q, v),
            Self::ViscousFriction(law) => law.effort(v),
            Self::CoulombFriction(law) => law.effort(v),
            Self::AsymmetricFriction(law) => law.effort(v),
            Self::StribeckFriction(law) => law.effort(v),
            Self::BiasForce(law) => law.effort(),
            Self::Spring(law) => law.effort(q),
            Self::TorqueRipple(law) => law.effort(q),
            Self::Backlash(law) => law.effort(q, v),
            Self::JointCompliance(law) => law.effort(q, v),
            Self::LinkFlexibility(law) => law.effort(q, v),
            Self::EndStop(law) => law.effort(q, v),
            Self::Formula(law) => law.effort(q, v),
        }
    }

    /// Resistance r in N s/m or N m s/rad at coordinate `q` and velocity `v`: what depends on the velocity is `-r v`, so that
    /// `effort(q, v) = effort(q, 0) - r v`. It is the slope of the chord from rest to `v`, not of the tangent.
    #[inline]
    pub fn resistance(&self, q: S, v: S) -> S {
        match self {
            Self::EmpiricalForce(law) => law.resistance(q, v),
            Self::ViscousFriction(law) => law.resistance(),
            Self::CoulombFriction(law) => law.resistance(v),
            Self::AsymmetricFriction(law) => law.resistance(v),
            Self::StribeckFriction(law) => law.resistance(v),
            Self::Backlash(law) => law.resistance(q),
            Self::JointCompliance(law) => law.resistance(),
            Self::LinkFlexibility(law) => law.resistance(),
            Self::EndStop(law) => law.resistance(q, v),
            Self::Formula(law) => law.resistance(q, v),
            Self::BiasForce(_) | Self::Spring(_) | Self::TorqueRipple(_) => S::zero(),
        }
    }

    /// The part of the resistance that is the same everywhere, N s/m or N m s/rad.
    #[inline]
    pub fn damping(&self) -> S {
        match self {
            Self::ViscousFriction(law) => law.resistance(),
            Self::JointCompliance(law) => law.resistance(),
            Self::LinkFlexibility(law) => law.resistance(),
            _ => S::zero(),
        }
    }

    /// Whether the resistance is the same everywhere, so that it is all [`JointEffect::damping`].
    #[inline]
    pub fn is_damped_linearly(&self) -> bool {
        matches!(
            self,
            Self::ViscousFriction(_)
                | Self::JointCompliance(_)
                | Self::LinkFlexibility(_)
                | Self::BiasForce(_)
                | Self::Spring(_)
                | Self::TorqueRipple(_)
        )
    }

    /// Effort at rest, N or N m, at coordinate `q`.
    #[inline]
    pub fn effort_at_rest(&self, q: S) -> S {
        match self {
            Self::EmpiricalForce(law) => law.effort_at_rest(q),
            Self::BiasForce(law) => law.effort(),
            Self::Spring(law) => law.effort(q),
            Self::TorqueRipple(law) => law.effort(q),
            Self::Backlash(law) => law.effort_at_rest(q),
            Self::JointCompliance(law) => law.effort_at_rest(q),
            Self::LinkFlexibility(law) => law.effort_at_rest(q),
            Self::EndStop(law) => law.effort_at_rest(q),
            Self::Formula(law) => law.effort_at_rest(q),
            Self::ViscousFriction(_)
            | Self::CoulombFriction(_)
            | Self::AsymmetricFriction(_)
            | Self::StribeckFriction(_) => S::zero(),
        }
    }

    /// Share k of the load |u| that is taken off besides, u the effort of the actuators on the joint; within -1 and 1.
    #[inline]
    pub fn share_of_load(&self, q: S, v: S) -> S {
        match self {
            Self::EmpiricalForce(law) => law.share_of_load(q, v),
            _ => S::zero(),
        }
    }

    /// Resistance per load |u| at velocity `v`, the chord from rest of that share.
    #[inline]
    pub fn resistance_per_load(&self, v: S) -> S {
        match self {
            Self::EmpiricalForce(law) => law.resistance_per_load(v),
            _ => S::zero(),
        }
    }

    /// Slope of the effort at rest by the coordinate, N/m or N m/rad.
    #[inline]
    pub fn slope_at_rest(&self, q: S) -> S {
        self.map(&mut |&parameter| Dual::<S, 1>::constant(parameter)).effort_at_rest(Dual::variable(q, 0)).gradient[0]
    }

    /// Potential energy in J at coordinate `q`: `effort = -d potential/dq` for effects of the coordinate alone, zero for friction,
    /// for formulas and for what is read off data.
    #[inline]
    pub fn potential(&self, q: S) -> S {
        match self {
            Self::BiasForce(law) => law.potential(q),
            Self::Spring(law) => law.potential(q),
            Self::TorqueRipple(law) => law.potential(q),
            Self::Backlash(law) => law.potential(q),
            Self::JointCompliance(law) => law.potential(q),
            Self::LinkFlexibility(law) => law.potential(q),
            Self::EndStop(law) => law.potential(q),
            Self::EmpiricalForce(_)
            | Self::ViscousFriction(_)
            | Self::CoulombFriction(_)
            | Self::AsymmetricFriction(_)
            | Self::StribeckFriction(_)
            | Self::Formula(_) => S::zero(),
        }
    }
}

/// tanh(x)/x, smooth through x = 0.
#[inline]
fn tanh_ratio<S: Scalar>(x: S) -> S {
    // The series 1 - x^2/3 + 2 x^4/15 ...: what is left out is below rounding.
    x.abs().if_less(S::from_f64(1e-4), || -(x * x / 3.0) + 1.0, || x.tanh() / x)
}
