//! Cross-sections with their material: stiffness and inertia per length.

use serde::{Deserialize, Serialize};

use super::shape::{Properties, Shape};
use super::{not_negative, positive};
use crate::error::{Error, Result};
use crate::scalar::Scalar;

/// An isotropic linear elastic material, over any parameter type.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material<P = f64> {
    /// Young's modulus E in Pa.
    pub young: P,
    /// Poisson's ratio.
    pub poisson: P,
    /// Density rho in kg/m^3.
    pub density: P,
}

impl<P> Material<P> {
    /// Material of a section over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Material<T> {
        Material { young: f(&self.young), poisson: f(&self.poisson), density: f(&self.density) }
    }
}

impl<S: Scalar> Material<S> {
    /// Shear modulus of a section's material `G = E / (2 (1 + nu))` in Pa.
    pub fn shear(&self) -> S {
        self.young / ((self.poisson + 1.0) * 2.0)
    }

    /// Checks the material of a section, whose numbers are called `{path}.young` and so on.
    pub(super) fn check_at(&self, path: &str) -> Result<()> {
        positive(&format!("{path}.young"), self.young)?;
        positive(&format!("{path}.density"), self.density)?;
        let poisson = self.poisson.inspect();
        if poisson > -1.0 && poisson <= 0.5 {
            return Ok(());
        }
        let condition = "lie above -1 and not above 0.5, as for every isotropic elastic solid";
        Err(Error::Domain { path: format!("{path}.poisson"), condition, value: poisson })
    }

    /// Material between two sections at `part` (0 to 1) of the way, each number in between.
    pub(super) fn between(&self, other: &Self, part: f64) -> Self {
        let mix = |here: S, there: S| here * (1.0 - part) + there * part;
        Self {
            young: mix(self.young, other.young),
            poisson: mix(self.poisson, other.poisson),
            density: mix(self.density, other.density),
        }
    }
}

/// Stiffness and inertia of a beam's section, about its centroid and principal axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section<S = f64> {
    /// `diag K = (EJx, EJy, GJ, ax GA, ay GA, EA)`: N m^2 three times, then N three times.
    pub stiffness: [S; 6],
    /// Inertia per length `rho (Jx, Jy, Jx + Jy, A, A, A)` about the centre of mass: kg m three times, then kg/m three times.
    pub inertia: [S; 6],
    /// Centre of mass along x and y in m, of sections that may have it beside the axis.
    pub center: Option<[S; 2]>,
}

impl<S: Scalar> Section<S> {
    /// The section of this shape and material.
    ///
    /// Twist resists with the torsion constant of Saint-Venant and moves with the polar moment, which differ unless the section is round.
    pub fn new(shape: Shape<S>, material: Material<S>) -> Result<Self> {
        Self::of(&shape, Some(&material))
    }

    /// As [`Section::new`]; layers and given moduli need no material.
    pub fn of(shape: &Shape<S>, material: Option<&Material<S>>) -> Result<Self> {
        match (shape, material) {
            (Shape::Layers(laminate), _) => laminate.section(),
            (Shape::Stiffness(moduli), _) => moduli.section(),
            (_, Some(material)) => Self::solid(shape, *material),
            (_, None) => {
                let condition = "be given for a section of one material";
                Err(Error::Domain { path: "material.young".to_owned(), condition, value: 0.0 })
            }
        }
    }

    fn solid(shape: &Shape<S>, material: Material<S>) -> Result<Self> {
        material.check_at("material")?;
        let Properties { area, moment_x, moment_y, torsion, shear_x, shear_y } = shape.properties(material.poisson)?;
        let (young, shear, density) = (material.young, material.shear(), material.density);
        let across = [shear_x, shear_y].map(|factor| factor * shear * area);
        let line = density * area;
        let [turn_x, turn_y] = [moment_x, moment_y].map(|moment| density * moment);
        Ok(Self {
            stiffness: [young * moment_x, young * moment_y, shear * torsion, across[0], across[1], young * area],
            inertia: [turn_x, turn_y, turn_x + turn_y, line, line, line],
            center: None,
        })
    }

    /// A section known by its stiffness and its inertia per length; the units are those of the fields.
    ///
    /// Checked: stiffness and mass positive, rotary inertia not negative, one mass for all directions.
    pub fn given(stiffness: [S; 6], inertia: [S; 6]) -> Result<Self> {
        for value in stiffness {
            positive("section.stiffness", value)?;
        }
        for &value in &inertia[..3] {
            not_negative("section.inertia", value)?;
        }
        for &value in &inertia[3..] {
            positive("section.inertia", value)?;
            if value.inspect() != inertia[3].inspect() {
                let condition = "be the same mass per length in all three directions";
                return Err(Error::Domain { path: "section.inertia".to_owned(), condition, value: value.inspect() });
            }
        }
        Ok(Self { stiffness, inertia, center: None })
    }

    /// Mass per length of a section in kg/m.
    pub fn line_density(&self) -> S {
        self.inertia[3]
    }
}
