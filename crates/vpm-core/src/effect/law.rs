//! What a law of a joint is: numbers in, effort out; some have a memory besides.

use crate::scalar::Scalar;

/// Largest share of a joint's load that one law takes: beyond it, the effort that a motion needs would not be unique.
const LARGEST_SHARE: f64 = 0.95;

/// A share of a joint's load within what one law takes either way.
#[inline]
pub(super) fn within_largest<S: Scalar>(share: S) -> S {
    let largest = S::from_f64(LARGEST_SHARE);
    share.max(-largest).min(largest)
}

/// An effort on a joint as a function of its coordinate q (m or rad), its velocity v and the effort u of the actuators on it (N or N m).
///
/// Law: `tau = effort(q, v) - share_of_load(q, v, u) |u|`. A law says what differs from nothing at all.
pub trait Law<S: Scalar> {
    /// Effort of a law, N or N m, but for what follows the load.
    #[inline]
    fn effort(&self, q: S, v: S) -> S {
        self.effort_at_rest(q) - self.resistance(q, v) * v
    }

    /// Effort of a law at rest, but for what follows the load.
    #[inline]
    fn effort_at_rest(&self, _q: S) -> S {
        S::zero()
    }

    /// Resistance r of a law in N s/m or N m s/rad: its velocity-dependent part is `-r v`.
    ///
    /// So `effort(q, v) = effort(q, 0) - r v`. It is the slope of the chord from rest to `v`, not of the tangent, and
    /// finite at rest.
    #[inline]
    fn resistance(&self, _q: S, _v: S) -> S {
        self.damping().unwrap_or_else(S::zero)
    }

    /// Damping of a law: its resistance where it is the same everywhere; none where it is not.
    #[inline]
    fn damping(&self) -> Option<S> {
        None
    }

    /// Potential energy of a law in J, `effort_at_rest = -d potential/dq`. It is zero for friction, for formulas and
    /// for what is read off data.
    #[inline]
    fn potential(&self, _q: S) -> S {
        S::zero()
    }

    /// Effort of a law with what follows the load.
    #[inline]
    fn effort_under(&self, q: S, v: S, u: S) -> S {
        if self.follows_load() { self.effort(q, v) - self.share_of_load(q, v, u) * u.abs() } else { self.effort(q, v) }
    }

    /// Whether a law takes a share of the load, which the motor side of a joint knows alone.
    #[inline]
    fn follows_load(&self) -> bool {
        false
    }

    /// Share k of the load |u| that a law takes off besides, within -1 and 1. Of u it may ask the sign alone.
    #[inline]
    fn share_of_load(&self, _q: S, _v: S, _u: S) -> S {
        S::zero()
    }

    /// Resistance of a law per load |u|. It is the chord from rest of the part of that share that vanishes there.
    #[inline]
    fn resistance_per_load(&self, _v: S, _u: S) -> S {
        S::zero()
    }
}

/// A law with a memory z, a state without unit that is zero at first.
pub trait MemoryLaw<S: Scalar> {
    /// Chords of a law with memory at velocity `v` and memory `z`: terms that are linear in both.
    fn chords(&self, v: S, z: S) -> MemoryChords<S>;

    /// Memory of a law after a `time` (s), from `z`: exact for a steady velocity. The joint has moved on by `way` (m or
    /// rad) in one direction.
    fn advance(&self, z: S, way: S, time: S) -> S;

    /// Reach of a law's memory: how far from zero it leads it at most.
    #[inline]
    fn reach(&self) -> S {
        S::one()
    }

    /// Effort of a law with memory, N or N m.
    #[inline]
    fn effort(&self, v: S, z: S) -> S {
        self.chords(v, z).effort(v, z)
    }

    /// Rate dz/dt of a law's memory, 1/s.
    #[inline]
    fn rate(&self, v: S, z: S) -> S {
        self.chords(v, z).rate(v, z)
    }
}

/// A law with a memory where it has come to: `tau = -push z - resistance v`, `dz/dt = gain v + source - fading z`.
#[derive(Clone, Copy, Debug)]
pub struct MemoryChords<S> {
    /// Effort per memory, N or N m.
    pub push: S,
    /// Effort per velocity, N s/m or N m s/rad.
    pub resistance: S,
    /// Memory per way, 1/m or 1/rad.
    pub gain: S,
    /// What drives the memory at rest, 1/s.
    pub source: S,
    /// How fast it fades, 1/s.
    pub fading: S,
}

impl<S: Scalar> MemoryChords<S> {
    /// Effort at `v` and `z` by the chords of a law with memory.
    #[inline]
    pub fn effort(&self, v: S, z: S) -> S {
        -(self.push * z + self.resistance * v)
    }

    /// Rate dz/dt at `v` and `z` by the chords of a law with memory.
    #[inline]
    pub fn rate(&self, v: S, z: S) -> S {
        self.gain * v + self.source - self.fading * z
    }

    /// This law where nothing rubs: without resistance and fading only a spring is left.
    pub(crate) fn frictionless(self) -> Self {
        Self { resistance: S::zero(), fading: S::zero(), ..self }
    }

    /// Chords of a law with memory, each number through `f`.
    pub(crate) fn map(self, f: impl Fn(S) -> S) -> Self {
        let Self { push, resistance, gain, source, fading } = self;
        Self { push: f(push), resistance: f(resistance), gain: f(gain), source: f(source), fading: f(fading) }
    }
}

/// Declares a law by its parameters, each with the [`super::Domain`] where it is defined.
macro_rules! law {
    ($(#[$doc:meta])* $name:ident { $($(#[$of_field:meta])* $field:ident: $domain:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name<P> {
            $($(#[$of_field])* pub $field: P,)*
        }

        impl<P> $name<P> {
            /// The same law over another number type.
            pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> $name<T> {
                $name { $($field: f(&self.$field),)* }
            }

            /// Parameters of a law with memory and where each is defined.
            pub fn domains(&self) -> Vec<(&P, super::Domain)> {
                vec![$((&self.$field, super::Domain::$domain),)*]
            }
        }
    };
}

/// Declares an enumeration of laws that answer to one trait.
macro_rules! family {
    ($(#[$doc:meta])* $name:ident: $law:ident { $($(#[$of_kind:meta])* $kind:ident,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, serde::Deserialize)]
        #[serde(tag = "type", rename_all = "snake_case")]
        pub enum $name<P> {
            $($(#[$of_kind])* $kind($kind<P>),)*
        }

        impl<P> $name<P> {
            /// Effect with its law over another number type.
            pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> $name<T> {
                match self {
                    $(Self::$kind(law) => $name::$kind(law.map(f)),)*
                }
            }

            /// Parameters of an effect's law and where each is defined.
            pub fn domains(&self) -> Vec<(&P, Domain)> {
                match self {
                    $(Self::$kind(law) => law.domains(),)*
                }
            }
        }

        impl<S: Scalar> $name<S> {
            /// The law of this effect, whichever kind it is.
            #[inline]
            pub fn law(&self) -> &dyn $law<S> {
                match self {
                    $(Self::$kind(law) => law,)*
                }
            }
        }
    };
}

pub(super) use {family, law};
