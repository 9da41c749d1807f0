//! Shapes of cross-sections: from sizes to area, second moments, torsion constant and shear factors.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::composite::{Laminate, Moduli};
use super::positive;
use crate::error::{Error, Result};
use crate::scalar::Scalar;

/// The shape of a section in the axes x and y, over any parameter type; all lengths in m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape<P = f64> {
    /// A full rectangle.
    Rectangle {
        /// Size along x.
        width: P,
        /// Size along y.
        height: P,
    },
    /// A full circle.
    Circle {
        /// Its diameter.
        diameter: P,
    },
    /// A round tube.
    Tube {
        /// Outer diameter.
        outer: P,
        /// Inner diameter.
        inner: P,
    },
    /// A doubly symmetric I: two flanges along x, a web along y.
    I {
        /// Width of the flanges along x.
        width: P,
        /// Total height along y.
        height: P,
        /// Thickness of a flange.
        flange: P,
        /// Thickness of the web.
        web: P,
    },
    /// Any other shape of one material, by its numbers.
    Given(Properties<P>),
    /// Layers of several materials.
    Layers(Laminate<P>),
    /// Stiffness and mass per length, without a shape.
    Stiffness(Moduli<P>),
}

/// What the law of a beam needs to know about a shape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Properties<P = f64> {
    /// Area A in m^2.
    pub area: P,
    /// Second moment about x, `Jx = int y^2 dA`, in m^4.
    pub moment_x: P,
    /// Second moment about y, `Jy = int x^2 dA`, in m^4.
    pub moment_y: P,
    /// Torsion constant of Saint-Venant J in m^4; the polar moment for round sections, less for all others.
    pub torsion: P,
    /// Shear factor ax along x.
    pub shear_x: P,
    /// Shear factor ay along y.
    pub shear_y: P,
}

impl<P> Shape<P> {
    /// The same shape over another parameter type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Shape<T> {
        match self {
            Self::Rectangle { width, height } => Shape::Rectangle { width: f(width), height: f(height) },
            Self::Circle { diameter } => Shape::Circle { diameter: f(diameter) },
            Self::Tube { outer, inner } => Shape::Tube { outer: f(outer), inner: f(inner) },
            Self::I { width, height, flange, web } => {
                Shape::I { width: f(width), height: f(height), flange: f(flange), web: f(web) }
            }
            Self::Given(numbers) => Shape::Given(Properties {
                area: f(&numbers.area),
                moment_x: f(&numbers.moment_x),
                moment_y: f(&numbers.moment_y),
                torsion: f(&numbers.torsion),
                shear_x: f(&numbers.shear_x),
                shear_y: f(&numbers.shear_y),
            }),
            Self::Layers(laminate) => Shape::Layers(laminate.map(f)),
            Self::Stiffness(moduli) => Shape::Stiffness(moduli.map(f)),
        }
    }
}

impl<S: Scalar> Shape<S> {
    /// The shape at `part` (0 to 1) of the way to another of the same kind, each size in between; none for different kinds.
    pub fn between(&self, other: &Self, part: f64) -> Option<Self> {
        if std::mem::discriminant(self) != std::mem::discriminant(other) {
            return None;
        }
        let sizes = |shape: &Self| {
            let mut sizes = Vec::with_capacity(6);
            shape.map(&mut |&size| sizes.push(size));
            sizes
        };
        let ends = sizes(other);
        // Layers, and shear that is not given, can differ in number.
        if ends.len() != sizes(self).len() {
            return None;
        }
        let mut ends = ends.into_iter();
        Some(self.map(&mut |&size| ends.next().map_or(size, |end| size * (1.0 - part) + end * part)))
    }

    /// The properties of the shape; `poisson` enters the shear factors.
    ///
    /// Sources: shear factors of rectangle, circle and tube from Cowper 1966, "The shear coefficient in Timoshenko's beam theory",
    /// J. Appl. Mech. 33(2); torsion of the rectangle from Timoshenko & Goodier 1970, "Theory of Elasticity", section 109; for
    /// the I thin-walled torsion, and the shear carried by the web along y and as in two rectangles along x.
    /// Checked: all sizes positive, the inner ones smaller than the outer ones.
    pub fn properties(&self, poisson: S) -> Result<Properties<S>> {
        match *self {
            Self::Rectangle { width, height } => rectangle(width, height, poisson),
            Self::Circle { diameter } => Ok(round(positive("section.diameter", diameter)?, S::zero(), poisson)),
            Self::Tube { outer, inner } => {
                positive("section.inner", inner)?;
                smaller("section.inner", inner, positive("section.outer", outer)?)?;
                Ok(round(outer, inner, poisson))
            }
            Self::I { width, height, flange, web } => i_section(width, height, flange, web),
            Self::Given(properties) => properties.checked(),
            Self::Layers(_) | Self::Stiffness(_) => {
                let condition = "be a shape of one material";
                Err(Error::Domain { path: "section.shape".to_owned(), condition, value: 0.0 })
            }
        }
    }
}

impl<S: Scalar> Properties<S> {
    fn checked(self) -> Result<Self> {
        for (path, value) in [
            ("section.area", self.area),
            ("section.moment_x", self.moment_x),
            ("section.moment_y", self.moment_y),
            ("section.torsion", self.torsion),
            ("section.shear_x", self.shear_x),
            ("section.shear_y", self.shear_y),
        ] {
            positive(path, value)?;
        }
        Ok(self)
    }
}

fn smaller<S: Scalar>(path: &str, value: S, limit: S) -> Result<()> {
    if value.inspect() < limit.inspect() {
        return Ok(());
    }
    let condition = "be smaller than the size of the section around it";
    Err(Error::Domain { path: path.to_owned(), condition, value: value.inspect() })
}

fn rectangle<S: Scalar>(width: S, height: S, poisson: S) -> Result<Properties<S>> {
    let area = positive("section.width", width)? * positive("section.height", height)?;
    let (long, short) = (width.max(height), width.min(height));
    let ratio = long / short;
    let series: S = (0..40).map(|k| f64::from(2 * k + 1)).map(|n| (ratio * (0.5 * n * PI)).tanh() / n.powi(5)).sum();
    let torsion = long * short.powi(3) / 3.0 * (S::one() - series * (192.0 / PI.powi(5)) / ratio);
    let shear = (poisson + 1.0) * 10.0 / (poisson * 11.0 + 12.0);
    let (moment_x, moment_y) = (area * height * height / 12.0, area * width * width / 12.0);
    Ok(Properties { area, moment_x, moment_y, torsion, shear_x: shear, shear_y: shear })
}

fn round<S: Scalar>(outer: S, inner: S, poisson: S) -> Properties<S> {
    let area = (outer * outer - inner * inner) * (PI / 4.0);
    let moment = (outer.powi(4) - inner.powi(4)) * (PI / 64.0);
    let ratio = (inner / outer).powi(2);
    let square = (ratio + 1.0).powi(2);
    let below = (poisson * 6.0 + 7.0) * square + (poisson * 12.0 + 20.0) * ratio;
    let shear = (poisson + 1.0) * 6.0 * square / below;
    Properties { area, moment_x: moment, moment_y: moment, torsion: moment * 2.0, shear_x: shear, shear_y: shear }
}

fn i_section<S: Scalar>(width: S, height: S, flange: S, web: S) -> Result<Properties<S>> {
    smaller("section.web", positive("section.web", web)?, positive("section.width", width)?)?;
    smaller("section.flange", positive("section.flange", flange)? * 2.0, positive("section.height", height)?)?;
    let inside = height - flange * 2.0;
    let (flanges, plate) = (width * flange * 2.0, inside * web);
    let area = flanges + plate;
    let moment_x = (width * height.powi(3) - (width - web) * inside.powi(3)) / 12.0;
    let moment_y = (flange * 2.0 * width.powi(3) + inside * web.powi(3)) / 12.0;
    let torsion = (width * 2.0 * flange.powi(3) + inside * web.powi(3)) / 3.0;
    let shear_x = flanges * (5.0 / 6.0) / area;
    Ok(Properties { area, moment_x, moment_y, torsion, shear_x, shear_y: plate / area })
}
