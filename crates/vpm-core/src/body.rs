//! Rigid bodies, each with the joint that carries it.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::joint::Joint;
use crate::scalar::Scalar;
use crate::spatial::{SpatialInertia, Symmetric3, Vector3, principal_moments};

/// Slack of the inertia checks relative to the largest principal moment: hand-typed moments of a plate are rounded.
const MOMENT_TOLERANCE: f64 = 1e-6;

/// A rigid body over any parameter type: `Body<usize>` holds indices into a parameter vector, `Body<S>` numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body<P> {
    /// Name, unique in the model.
    pub name: String,
    /// Number of the body it hangs on; none for the world.
    pub parent: Option<usize>,
    /// The joint between parent and body. The body's frame is the joint frame, moved by the joint.
    pub joint: Joint,
    /// Mass in kg.
    pub mass: P,
    /// Centre of mass in the body's frame, in m.
    pub center_of_mass: [P; 3],
    /// Rotational inertia xx yy zz xy xz yz about the centre of mass, body axes, in kg m^2; xy is the tensor's entry.
    pub inertia: [P; 6],
}

/// A mass rigidly attached to a body in one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMass<S> {
    /// Number of the body.
    pub body: usize,
    /// Mass in kg.
    pub mass: S,
    /// Position in the body's frame, in m.
    pub position: [S; 3],
}

impl<P> Body<P> {
    /// The same body over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Body<T> {
        Body {
            name: self.name.clone(),
            parent: self.parent,
            joint: self.joint.clone(),
            mass: f(&self.mass),
            center_of_mass: self.center_of_mass.each_ref().map(&mut *f),
            inertia: self.inertia.each_ref().map(&mut *f),
        }
    }
}

impl<S: Scalar> Body<S> {
    /// Its spatial inertia in the body's frame.
    pub fn spatial_inertia(&self) -> SpatialInertia<S> {
        SpatialInertia::new(self.mass, Vector3::from(self.center_of_mass), Symmetric3::from_array(self.inertia))
    }

    /// Whether a real body can have these numbers: finite, positive mass, principal moments that satisfy the triangle
    /// inequality. That is the same as a non-negative distribution of mass (Wensing, Kim & Slotine 2018, "Linear matrix
    /// inequalities for physically consistent inertial parameter identification"). Zero inertia passes: a point mass.
    pub fn check(&self) -> Result<()> {
        self.check_finite()?;
        check_physical(&self.name, self.mass.re(), Symmetric3::from_array(self.inertia.map(|entry| entry.re())), 0.0)
    }

    fn check_finite(&self) -> Result<()> {
        const INERTIA: [&str; 6] = ["inertia.xx", "inertia.yy", "inertia.zz", "inertia.xy", "inertia.xz", "inertia.yz"];
        const CENTER: [&str; 3] = ["center_of_mass.x", "center_of_mass.y", "center_of_mass.z"];
        let named = std::iter::once(("mass", self.mass))
            .chain(CENTER.into_iter().zip(self.center_of_mass))
            .chain(INERTIA.into_iter().zip(self.inertia));
        for (parameter, number) in named {
            if !number.is_finite() {
                return Err(Error::NonFinite { path: format!("{}.{parameter}", self.name), value: number.re() });
            }
        }
        Ok(())
    }
}

/// Checks a mass (kg) and an inertia about the centre of mass (kg m^2), with `slack` (kg m^2) for its own rounding.
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
