//! Transmissions: shafts that turn with a combination of joints, as in wrists and differentials.

use serde::Deserialize;

/// A shaft, the motor side of a gear, whose angle is a fixed linear combination of joint coordinates.
///
/// Law: `theta = sum r_i q_i`; an effort tau on the shaft gives `r_i tau` at joint i, by virtual work; a rotor of inertia J on it adds
/// `J r r^T` to the mass matrix. What the turning rotor does to the body that carries it, gyroscopic moments, is left out. Source: Siciliano,
/// Sciavicco, Villani & Oriolo 2009, "Robotics: Modelling, Planning and Control", sections 7.1 (rotors) and 8.1 (the matrix of ratios);
/// Featherstone 2008, "Rigid Body Dynamics Algorithms", section 9.6. Checked: ratios are not zero, the inertia not negative.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transmission<P> {
    /// Name, unique in the model.
    pub name: String,
    /// Ratio of each joint that moves with it.
    pub ratios: Vec<Ratio<P>>,
    /// Inertia of the rotor about the shaft, kg m^2; none without one.
    pub inertia: Option<P>,
}

/// How much a shaft turns with a joint.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ratio<P> {
    /// Number of the joint.
    pub joint: usize,
    /// Turn of the shaft per unit of its coordinate, rad/rad or rad/m.
    pub ratio: P,
}

impl<P> Ratio<P> {
    /// Transmission ratio over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Ratio<T> {
        Ratio { joint: self.joint, ratio: f(&self.ratio) }
    }
}

impl<P> Transmission<P> {
    /// The same transmission over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Transmission<T> {
        Transmission {
            name: self.name.clone(),
            ratios: self.ratios.iter().map(|ratio| ratio.map(f)).collect(),
            inertia: self.inertia.as_ref().map(f),
        }
    }
}
