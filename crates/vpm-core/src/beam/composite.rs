//! Sections that are not one shape of one material: layers glued to one another, and stiffness that was measured or computed.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::quadrature::gauss;
use super::section::Section;
use super::{Material, not_negative, positive};
use crate::error::{Error, Result};
use crate::scalar::Scalar;

/// Most layers of a laminate.
const MOST: usize = 60;
/// Fewest and most terms of the series of torsion.
const TERMS: (f64, f64) = (20.0, 2000.0);
/// `sum 1 / n^5` over odd n: `31 zeta(5) / 32`.
const ODD_FIFTHS: f64 = 1.004_523_762_795_139_6;

/// Layers of equal width, one on the other along y, the first one lowest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Laminate<P = f64> {
    /// Size along x in m.
    pub width: P,
    /// From the lowest y up.
    pub layers: Vec<Layer<P>>,
}

/// One layer of a laminate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer<P = f64> {
    /// Size along y in m.
    pub thickness: P,
    /// What it is made of.
    pub material: Material<P>,
}

/// Stiffness and inertia per length by their numbers, without a shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Moduli<P = f64> {
    /// EJx in N m^2.
    pub bending_x: P,
    /// EJy in N m^2.
    pub bending_y: P,
    /// GJ in N m^2.
    pub torsion: P,
    /// EA in N.
    pub extension: P,
    /// ax GA in N, where the beam shears along x.
    #[serde(default = "none")]
    pub shear_x: Option<P>,
    /// ay GA in N, where the beam shears along y.
    #[serde(default = "none")]
    pub shear_y: Option<P>,
    /// Mass per length in kg/m.
    pub mass: P,
    /// Rotary inertia per length about x in kg m.
    pub inertia_x: P,
    /// Rotary inertia per length about y in kg m.
    pub inertia_y: P,
}

fn none<P>() -> Option<P> {
    None
}

impl<P> Laminate<P> {
    /// Composite section of the same layers over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Laminate<T> {
        let width = f(&self.width);
        let layer = |layer: &Layer<P>| Layer { thickness: f(&layer.thickness), material: layer.material.map(f) };
        Laminate { width, layers: self.layers.iter().map(layer).collect() }
    }
}

impl<P> Moduli<P> {
    /// Moduli of the same composite section over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Moduli<T> {
        Moduli {
            bending_x: f(&self.bending_x),
            bending_y: f(&self.bending_y),
            torsion: f(&self.torsion),
            extension: f(&self.extension),
            shear_x: self.shear_x.as_ref().map(&mut *f),
            shear_y: self.shear_y.as_ref().map(&mut *f),
            mass: f(&self.mass),
            inertia_x: f(&self.inertia_x),
            inertia_y: f(&self.inertia_y),
        }
    }
}

impl<S: Scalar> Moduli<S> {
    /// Composite section from measured or computed moduli. Where no shear is given the beam is rigid in it, and any
    /// number stands there.
    pub(super) fn section(&self) -> Result<Section<S>> {
        let shear = [self.shear_x, self.shear_y].map(|shear| shear.unwrap_or(self.extension));
        let stiffness = [self.bending_x, self.bending_y, self.torsion, shear[0], shear[1], self.extension];
        let names = ["bending_x", "bending_y", "torsion", "shear_x", "shear_y", "extension"];
        for (name, value) in names.into_iter().zip(stiffness) {
            positive(&format!("section.{name}"), value)?;
        }
        let mass = positive("section.mass", self.mass)?;
        let [x, y] = [("inertia_x", self.inertia_x), ("inertia_y", self.inertia_y)];
        let turning = [x, y].map(|(name, value)| not_negative(&format!("section.{name}"), value));
        let [x, y] = turning;
        let (x, y) = (x?, y?);
        Ok(Section { stiffness, inertia: [x, y, x + y, mass, mass, mass], center: None })
    }
}

/// A layer whose numbers are positive, and where it lies.
struct Ply<S> {
    thickness: S,
    young: S,
    shear: S,
    density: S,
    /// Its middle above the lowest face.
    middle: S,
}

impl<S: Scalar> Laminate<S> {
    /// Composite section from glued layers. Its axis runs through the neutral axis, where a force along it does not
    /// bend; the centre of mass may lie beside it.
    ///
    /// Law: parallel axes, with the moduli as weights. Shear along y stores what the stress of equilibrium stores, `1 / GA = 1 / EJ^2
    /// int Q^2 / (G b) dy` with `Q = int E y b dy`; along x each layer carries 5/6 of its area. Sources: Bert 1973, "Simplified analysis of
    /// static shear factors for beams of nonhomogeneous cross section", J. Composite Materials 7. Checked: sizes and materials of all layers.
    pub(super) fn section(&self) -> Result<Section<S>> {
        let (width, plies) = (positive("section.width", self.width)?, self.plies()?);
        let sum = |f: &dyn Fn(&Ply<S>) -> S| plies.iter().map(f).sum::<S>() * width;
        let (extension, mass) = (sum(&|ply| ply.young * ply.thickness), sum(&|ply| ply.density * ply.thickness));
        let neutral = sum(&|ply| ply.young * ply.thickness * ply.middle) / extension;
        let heavy = sum(&|ply| ply.density * ply.thickness * ply.middle) / mass;
        let about = |ply: &Ply<S>, axis: S| {
            ply.thickness * (ply.thickness * ply.thickness / 12.0 + (ply.middle - axis) * (ply.middle - axis))
        };
        let bending = sum(&|ply| ply.young * about(ply, neutral));
        let turning = sum(&|ply| ply.density * about(ply, heavy));
        let across = width * width / 12.0;
        let shear_x = sum(&|ply| ply.shear * ply.thickness) * (5.0 / 6.0);
        let shear_y = shear_along(&plies, width, neutral, bending);
        let turning_y = mass * across;
        Ok(Section {
            stiffness: [bending, extension * across, torsion(&plies, width), shear_x, shear_y, extension],
            inertia: [turning, turning_y, turning + turning_y, mass, mass, mass],
            center: Some([S::zero(), heavy - neutral]),
        })
    }

    fn plies(&self) -> Result<Vec<Ply<S>>> {
        if !(1..=MOST).contains(&self.layers.len()) {
            let condition = "lie between 1 and 60 for the number of layers";
            return Err(Error::Domain {
                path: "section.layers".to_owned(),
                condition,
                value: self.layers.len() as f64,
            });
        }
        let mut below = S::zero();
        let ply = |(place, layer): (usize, &Layer<S>)| {
            let thickness = positive(&format!("section.layers.{place}.thickness"), layer.thickness)?;
            layer.material.check_at(&format!("section.layers.{place}"))?;
            let middle = below + thickness * 0.5;
            below += thickness;
            let Material { young, density, .. } = layer.material;
            Ok(Ply { thickness, young, shear: layer.material.shear(), density, middle })
        };
        self.layers.iter().enumerate().map(ply).collect()
    }
}

/// Shear stiffness of a composite section through the layers.
fn shear_along<S: Scalar>(plies: &[Ply<S>], width: S, neutral: S, bending: S) -> S {
    let (mut flow, mut energy) = (S::zero(), S::zero());
    for ply in plies {
        let bottom = ply.middle - ply.thickness * 0.5 - neutral;
        // Q grows by E b times the first moment of what lies below; its square is of degree four.
        let grown = |part: f64| {
            let up = ply.thickness * part;
            flow + ply.young * width * up * (bottom + up * 0.5)
        };
        let squares: S = gauss(3, 0.0, 1.0).iter().map(|at| grown(at.place) * grown(at.place) * at.weight).sum();
        energy += squares * ply.thickness / (ply.shear * width);
        flow = grown(1.0);
    }
    bending * bending / energy
}

/// Torsional stiffness of a composite section as a whole block.
///
/// Law: Prandtl's stress function, `div(grad phi / G) = -2`, zero at the edge, `GJ = 2 int phi dA`, as a cosine series across the width:
/// in a layer `f = p + A cosh + B sinh`, continuous with `f' / G` from layer to layer. The terms of far ends, `1 / n^5`, are summed in
/// closed form. Source: Timoshenko & Goodier 1970, section 109, there for one material. Checked: it for equal layers, finite differences.
fn torsion<S: Scalar>(plies: &[Ply<S>], width: S) -> S {
    let least = plies.iter().map(|ply| ply.thickness.inspect()).fold(f64::INFINITY, f64::min);
    // From here on no layer feels its other side: tanh is 1 to rounding.
    let terms = (12.0 * width.inspect() / least).clamp(TERMS.0, TERMS.1) as usize;
    let far = term(plies, &vec![S::one(); plies.len()]);
    let mut series = far * ODD_FIFTHS;
    for n in (1..=terms).map(|k| (2 * k - 1) as f64) {
        let sides: Vec<S> = plies.iter().map(|ply| (ply.thickness / width * (0.5 * n * PI)).tanh()).collect();
        series += (term(plies, &sides) - far) / n.powi(5);
    }
    let walls: S = plies.iter().map(|ply| ply.shear * ply.thickness).sum();
    width.powi(3) * (walls / 3.0 + width * series * (32.0 / PI.powi(5)))
}

/// Term of a composite section's torsion: `sum (u_below + u_above - 2 G) tanh` over the layers. u is the stress
/// function at their faces; `sides` are the `tanh`.
fn term<S: Scalar>(plies: &[Ply<S>], sides: &[S]) -> S {
    // u is zero at both outer faces; between them a tridiagonal system, solved from below.
    let own = |k: usize| {
        let (tanh, square) = (sides[k], sides[k] * sides[k]);
        let scale = (tanh * plies[k].shear * 2.0).recip();
        [(square + 1.0) * scale, (S::one() - square) * scale]
    };
    let inner = plies.len() - 1;
    let (mut factors, mut right) = (Vec::with_capacity(inner), Vec::with_capacity(inner));
    for j in 0..inner {
        let ([here, below], [next, above]) = (own(j), own(j + 1));
        let (before, value) = match j {
            0 => (S::zero(), S::zero()),
            _ => (factors[j - 1], right[j - 1]),
        };
        let pivot = here + next - below * before;
        factors.push(above / pivot);
        right.push((sides[j] + sides[j + 1] + below * value) / pivot);
    }
    let (mut sum, mut upper) = (S::zero(), S::zero());
    for k in (0..plies.len()).rev() {
        let lower = match k {
            0 => S::zero(),
            _ => right[k - 1] + factors[k - 1] * upper,
        };
        sum += (lower + upper - plies[k].shear * 2.0) * sides[k];
        upper = lower;
    }
    sum
}
