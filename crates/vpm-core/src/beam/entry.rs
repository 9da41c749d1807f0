//! A beam as data: where it hangs, what it is made of, how finely it bends.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

use super::reduced::Reduced;
use super::rest::RestEntry;
use super::section::Material;
use super::shape::Shape;
use crate::mount::Mount;
use crate::scalar::Scalar;

/// A component of the strain screw `(theta_x', theta_y', theta_z', v_x' - theta_y, v_y' + theta_x, v_z')`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Component {
    /// Curvature about x, deflects along y.
    BendingX,
    /// Curvature about y, deflects along x.
    BendingY,
    /// Twist.
    Torsion,
    /// Shear along x.
    ShearX,
    /// Shear along y.
    ShearY,
    /// Extension.
    Extension,
}

impl Component {
    /// All six, in the order of the screw.
    pub const ALL: [Self; 6] =
        [Self::BendingX, Self::BendingY, Self::Torsion, Self::ShearX, Self::ShearY, Self::Extension];
}

/// How finely a beam deforms, and by which kinematics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Not at all.
    Rigid,
    /// That many rigid segments of equal length with springs between them.
    Lumped(usize),
    /// The slowest clamped modes of each component, displacement kinematics.
    Modal(usize),
    /// A Bezier centreline of that degree: the control points of the deflection give the strain, exact geometry.
    Bezier(usize),
    /// The same control points, displacement kinematics: right up to second order in the deflection.
    Deflection(usize),
    /// That many cubic elements, displacement kinematics.
    Hermite(usize),
    /// That many Legendre coefficients of strain for each component: exact geometry.
    Strain(usize),
    /// That many elements of continuous, piecewise linear strain: exact geometry.
    Elements(usize),
    /// That many modes of a reduced solid, displacement kinematics.
    Reduced(usize),
}

/// The section at one place of the axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SectionEntry<P> {
    /// Arc length from the root in m.
    pub at: f64,
    /// The shape there.
    pub shape: Shape<P>,
    /// Its material, if it is not that of the beam.
    #[serde(default = "none")]
    pub material: Option<Material<P>>,
}

impl<P> SectionEntry<P> {
    /// Entry of a section of the beam's material.
    pub fn new(at: f64, shape: Shape<P>) -> Self {
        Self { at, shape, material: None }
    }

    /// Section entry over another parameter type.
    fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> SectionEntry<T> {
        let shape = self.shape.map(f);
        SectionEntry { at: self.at, shape, material: self.material.as_ref().map(|material| material.map(f)) }
    }
}

/// What takes energy out of a beam that vibrates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DampingEntry<P> {
    /// Damping per stiffness in s (Kelvin-Voigt).
    #[serde(default = "none")]
    pub stiffness: Option<P>,
    /// Damping per mass of the clamped beam in 1/s.
    #[serde(default = "none")]
    pub mass: Option<P>,
    /// Damping ratio of each clamped mode of the beam alone, slowest first.
    #[serde(default = "Vec::new")]
    pub ratios: Vec<P>,
}

fn none<P>() -> Option<P> {
    None
}

impl<P> Default for DampingEntry<P> {
    fn default() -> Self {
        Self { stiffness: None, mass: None, ratios: Vec::new() }
    }
}

/// A beam that leaves its root along z, over any parameter type: `BeamEntry<usize>` holds places in a parameter vector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self", deny_unknown_fields)]
pub struct BeamEntry<P> {
    /// Name, unique in the model.
    pub name: String,
    /// What carries the root.
    pub on: Mount,
    /// Origin of the root frame in the mount's frame, in m.
    pub translation: [f64; 3],
    /// Axes of the root frame in the mount's frame, row by row.
    pub rotation: [f64; 9],
    /// Length in m; of a reduced solid the number of its interfaces beside that at the root, and places along it are their numbers.
    pub length: f64,
    /// How finely it deforms.
    pub level: Level,
    /// The strains it may have; all others are rigid.
    pub deforms: Vec<Component>,
    /// What sections of one material are made of that name none.
    #[serde(default = "none")]
    pub material: Option<Material<P>>,
    /// One section if all are alike, otherwise several, between which sizes and materials are interpolated linearly.
    pub sections: Vec<SectionEntry<P>>,
    /// Curvature and twist where nothing loads it, at ascending places; none if it is straight, one if they are constant.
    #[serde(default)]
    pub rest: Vec<RestEntry>,
    /// Its damping.
    #[serde(default = "DampingEntry::default")]
    pub damping: DampingEntry<P>,
    /// The reduced solid that takes the place of sections; `young` and `density` are factors on its stiffness and its mass then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reduced: Option<Reduced>,
}

impl<P> BeamEntry<P> {
    /// Beam entry over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> BeamEntry<T> {
        BeamEntry {
            name: self.name.clone(),
            on: self.on,
            translation: self.translation,
            rotation: self.rotation,
            length: self.length,
            level: self.level,
            deforms: self.deforms.clone(),
            material: self.material.as_ref().map(|material| material.map(f)),
            sections: self.sections.iter().map(|entry| entry.map(f)).collect(),
            rest: self.rest.clone(),
            damping: DampingEntry {
                stiffness: self.damping.stiffness.as_ref().map(&mut *f),
                mass: self.damping.mass.as_ref().map(&mut *f),
                ratios: self.damping.ratios.iter().map(&mut *f).collect(),
            },
            reduced: self.reduced.clone(),
        }
    }
}

impl<S: Scalar> BeamEntry<S> {
    /// Factors in a beam entry on stiffness and mass of a reduced solid: its material's `young` and `density`.
    pub(crate) fn factors(&self) -> (S, S) {
        self.material.as_ref().map_or((S::one(), S::one()), |material| (material.young, material.density))
    }
}

impl<'de, P: DeserializeOwned> Deserialize<'de> for BeamEntry<P> {
    /// Reads a beam entry strictly, and says in which beam a mistake is.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = Map::<String, Value>::deserialize(deserializer)?;
        let name = table.get("name").and_then(Value::as_str).unwrap_or("without name").to_owned();
        Self::deserialize(Value::Object(table))
            .map_err(|error| serde::de::Error::custom(format!("beam `{name}`: {error}")))
    }
}
