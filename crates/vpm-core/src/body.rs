//! Rigid bodies, each with the joint that carries it or welded to something.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::joint::Joint;
use crate::mount::Mount;
use crate::scalar::Scalar;
use crate::spatial::{SpatialInertia, Symmetric3, Vector3, principal_moments};

/// Slack of the inertia checks relative to the largest principal moment: hand-typed moments of a plate are rounded.
const MOMENT_TOLERANCE: f64 = 1e-6;

/// A body on a joint, over any parameter type: `Body<usize>` holds indices into a parameter vector, `Body<S>` numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body<P> {
    /// Name, unique in the model.
    pub name: String,
    /// What the joint sits on.
    pub on: Mount,
    /// The joint between mount and body. The body's frame is the joint frame, moved by the joint.
    pub joint: Joint,
    /// What makes it heavy; without it the body is a massless carrier of the next joint.
    pub inertia: Option<Inertia<P>>,
    /// Inertia of the drive's rotor as the joint feels it, ratio squared times its own, in kg m^2 (kg on a sliding joint).
    ///
    /// It resists the joint's acceleration and nothing else, which leaves out what the turning rotor does to the body that carries it:
    /// right for ratios well above 1 (Spong 1987, "Modeling and control of elastic joint robots", assumption A2).
    #[serde(default = "none")]
    pub rotor_inertia: Option<P>,
}

/// Missing rotor of a body (the derive would ask for `P: Default`).
fn none<T>() -> Option<T> {
    None
}

/// A rigid body without a joint of its own: a motor, a hub, a load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weld<P> {
    /// Name, unique in the model.
    pub name: String,
    /// What it is fixed to.
    pub on: Mount,
    /// Its origin in the mount's frame, m.
    pub translation: [f64; 3],
    /// Its axes in the mount's frame, row by row.
    pub rotation: [f64; 9],
    /// What makes it heavy.
    pub inertia: Inertia<P>,
}

/// Mass, centre of mass and moments of inertia of a rigid body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertia<P> {
    /// Mass in kg.
    pub mass: P,
    /// Centre of mass in the body's frame, in m.
    pub center_of_mass: [P; 3],
    /// Rotational inertia xx yy zz xy xz yz about the centre of mass, body axes, in kg m^2; xy is the tensor's entry.
    pub moments: [P; 6],
}

/// What a point mass sits on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Site {
    /// The body of that number.
    Body(usize),
    /// The weld of that number, in its own frame.
    Weld(usize),
    /// The section at the tip of the beam of that number.
    Tip(usize),
}

/// A mass rigidly attached to a body, or to the tip of a beam, in one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMass<S> {
    /// What it sits on.
    pub on: Site,
    /// Mass in kg.
    pub mass: S,
    /// Position in the body's or section's frame, in m.
    pub position: [S; 3],
}

impl<P> Inertia<P> {
    /// Inertia of a body over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Inertia<T> {
        Inertia {
            mass: f(&self.mass),
            center_of_mass: self.center_of_mass.each_ref().map(&mut *f),
            moments: self.moments.each_ref().map(&mut *f),
        }
    }
}

impl<P> Body<P> {
    /// The same body over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Body<T> {
        let inertia = self.inertia.as_ref().map(|inertia| inertia.map(f));
        let rotor_inertia = self.rotor_inertia.as_ref().map(f);
        Body { name: self.name.clone(), on: self.on, joint: self.joint.clone(), inertia, rotor_inertia }
    }
}

impl<P> Weld<P> {
    /// The same body over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Weld<T> {
        let Self { name, on, translation, rotation, inertia } = self;
        Weld { name: name.clone(), on: *on, translation: *translation, rotation: *rotation, inertia: inertia.map(f) }
    }
}

impl<S: Scalar> Inertia<S> {
    /// As a spatial inertia in the body's frame.
    pub fn spatial(&self) -> SpatialInertia<S> {
        SpatialInertia::new(self.mass, Vector3::from(self.center_of_mass), Symmetric3::from_array(self.moments))
    }

    /// The spatial inertia, if a real body `name` can have these numbers: finite, positive mass, principal moments that satisfy the
    /// triangle inequality. That is the same as a non-negative distribution of mass (Wensing, Kim & Slotine 2018, "Linear matrix
    /// inequalities for physically consistent inertial parameter identification"). Zero moments pass: a point mass.
    pub fn checked(&self, name: &str) -> Result<SpatialInertia<S>> {
        self.check_finite(name)?;
        check_physical(
            name,
            self.mass.inspect(),
            Symmetric3::from_array(self.moments.map(|entry| entry.inspect())),
            0.0,
        )?;
        Ok(self.spatial())
    }

    fn check_finite(&self, name: &str) -> Result<()> {
        const INERTIA: [&str; 6] = ["inertia.xx", "inertia.yy", "inertia.zz", "inertia.xy", "inertia.xz", "inertia.yz"];
        const CENTER: [&str; 3] = ["center_of_mass.x", "center_of_mass.y", "center_of_mass.z"];
        let named = std::iter::once(("mass", self.mass))
            .chain(CENTER.into_iter().zip(self.center_of_mass))
            .chain(INERTIA.into_iter().zip(self.moments));
        for (parameter, number) in named {
            if !number.is_finite() {
                return Err(Error::NonFinite { path: format!("{name}.{parameter}"), value: number.inspect() });
            }
        }
        Ok(())
    }
}

impl<S: Scalar> Body<S> {
    /// Its spatial inertia in its own frame: that of a real body, or none for a massless carrier.
    pub fn spatial_inertia(&self) -> Result<SpatialInertia<S>> {
        self.inertia.map_or(Ok(SpatialInertia::zero()), |inertia| inertia.checked(&self.name))
    }

    /// Rotor inertia of a body's joint, zero without one. Checked: finite and not negative.
    pub fn rotor(&self) -> Result<S> {
        let rotor = self.rotor_inertia.unwrap_or(S::zero());
        let path = || format!("{}.rotor_inertia", self.joint.name);
        if !rotor.is_finite() {
            return Err(Error::NonFinite { path: path(), value: rotor.inspect() });
        }
        if rotor.inspect() < 0.0 {
            return Err(Error::Domain { path: path(), condition: "be zero or positive", value: rotor.inspect() });
        }
        Ok(rotor)
    }
}

/// Checks a body's mass (kg) and inertia about the centre of mass (kg m^2). `slack` (kg m^2) is for its own rounding.
pub(crate) fn check_physical(body: &str, mass: f64, central: Symmetric3<f64>, slack: f64) -> Result<()> {
    if mass.is_nan() || mass <= 0.0 {
        return Err(Error::Mass { body: body.to_owned(), mass });
    }
    let moments @ [smallest, middle, largest] = principal_moments(central);
    let tolerance = MOMENT_TOLERANCE * largest.abs() + slack;
    if smallest < -tolerance || largest > smallest + middle + tolerance {
        return Err(Error::Inertia { body: body.to_owned(), moments });
    }
    Ok(())
}
