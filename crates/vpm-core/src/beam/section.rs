//! Cross-sections: from sizes and material to stiffness and inertia per length.

use std::f64::consts::PI;

use super::{not_negative, positive};
use crate::error::{Error, Result};

/// An isotropic linear elastic material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Young's modulus E in Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density rho in kg/m^3.
    pub density: f64,
}

impl Material {
    /// Shear modulus `G = E / (2 (1 + nu))` in Pa.
    pub fn shear(&self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    fn check(&self) -> Result<()> {
        positive("material.young", self.young)?;
        positive("material.density", self.density)?;
        if self.poisson > -1.0 && self.poisson <= 0.5 {
            return Ok(());
        }
        let condition = "lie above -1 and not above 0.5, as for every isotropic elastic solid";
        Err(Error::Domain { path: "material.poisson".to_owned(), condition, value: self.poisson })
    }
}

/// The shape of a section in the axes x and y; all lengths in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A full rectangle.
    Rectangle {
        /// Size along x.
        width: f64,
        /// Size along y.
        height: f64,
    },
    /// A full circle.
    Circle {
        /// Its diameter.
        diameter: f64,
    },
    /// A round tube.
    Tube {
        /// Outer diameter.
        outer: f64,
        /// Inner diameter.
        inner: f64,
    },
    /// A doubly symmetric I: two flanges along x, a web along y.
    I {
        /// Width of the flanges along x.
        width: f64,
        /// Total height along y.
        height: f64,
        /// Thickness of a flange.
        flange: f64,
        /// Thickness of the web.
        web: f64,
    },
    /// Anything else, by its numbers.
    Given(Properties),
}

/// What the law of a beam needs to know about a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Properties {
    /// Area A in m^2.
    pub area: f64,
    /// Second moment about x, `Jx = int y^2 dA`, in m^4.
    pub moment_x: f64,
    /// Second moment about y, `Jy = int x^2 dA`, in m^4.
    pub moment_y: f64,
    /// Torsion constant of Saint-Venant J in m^4; the polar moment for round sections, less for all others.
    pub torsion: f64,
    /// Shear factor ax along x.
    pub shear_x: f64,
    /// Shear factor ay along y.
    pub shear_y: f64,
}

impl Shape {
    /// The properties of the shape; `poisson` enters the shear factors.
    ///
    /// Sources: shear factors of rectangle, circle and tube from Cowper 1966, "The shear coefficient in Timoshenko's beam theory",
    /// J. Appl. Mech. 33(2); torsion of the rectangle from Timoshenko & Goodier 1970, "Theory of Elasticity", section 109; for
    /// the I thin-walled torsion, and the shear carried by the web along y and as in two rectangles along x.
    /// Checked: all sizes positive, the inner ones smaller than the outer ones.
    pub fn properties(&self, poisson: f64) -> Result<Properties> {
        match *self {
            Self::Rectangle { width, height } => rectangle(width, height, poisson),
            Self::Circle { diameter } => round(positive("section.diameter", diameter)?, 0.0, poisson),
            Self::Tube { outer, inner } => {
                positive("section.inner", inner)?;
                smaller("section.inner", inner, positive("section.outer", outer)?)?;
                round(outer, inner, poisson)
            }
            Self::I { width, height, flange, web } => i_section(width, height, flange, web),
            Self::Given(properties) => properties.checked(),
        }
    }
}

impl Properties {
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

fn smaller(path: &str, value: f64, limit: f64) -> Result<()> {
    if value < limit {
        return Ok(());
    }
    let condition = "be smaller than the size of the section around it";
    Err(Error::Domain { path: path.to_owned(), condition, value })
}

fn rectangle(width: f64, height: f64, poisson: f64) -> Result<Properties> {
    let area = positive("section.width", width)? * positive("section.height", height)?;
    let (long, short) = (width.max(height), width.min(height));
    let series: f64 =
        (0..40).map(|k| f64::from(2 * k + 1)).map(|n| (n * PI * long / (2.0 * short)).tanh() / n.powi(5)).sum();
    let torsion = long * short.powi(3) / 3.0 * (1.0 - 192.0 / PI.powi(5) * short / long * series);
    let shear = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson);
    let (moment_x, moment_y) = (area * height * height / 12.0, area * width * width / 12.0);
    Ok(Properties { area, moment_x, moment_y, torsion, shear_x: shear, shear_y: shear })
}

fn round(outer: f64, inner: f64, poisson: f64) -> Result<Properties> {
    let area = PI / 4.0 * (outer * outer - inner * inner);
    let moment = PI / 64.0 * (outer.powi(4) - inner.powi(4));
    let ratio = (inner / outer).powi(2);
    let square = (1.0 + ratio).powi(2);
    let below = (7.0 + 6.0 * poisson) * square + (20.0 + 12.0 * poisson) * ratio;
    let shear = 6.0 * (1.0 + poisson) * square / below;
    let torsion = 2.0 * moment;
    Ok(Properties { area, moment_x: moment, moment_y: moment, torsion, shear_x: shear, shear_y: shear })
}

fn i_section(width: f64, height: f64, flange: f64, web: f64) -> Result<Properties> {
    smaller("section.web", positive("section.web", web)?, positive("section.width", width)?)?;
    smaller("section.flange", 2.0 * positive("section.flange", flange)?, positive("section.height", height)?)?;
    let inside = height - 2.0 * flange;
    let (flanges, plate) = (2.0 * width * flange, inside * web);
    let area = flanges + plate;
    let moment_x = (width * height.powi(3) - (width - web) * inside.powi(3)) / 12.0;
    let moment_y = (2.0 * flange * width.powi(3) + inside * web.powi(3)) / 12.0;
    let torsion = (2.0 * width * flange.powi(3) + inside * web.powi(3)) / 3.0;
    Ok(Properties { area, moment_x, moment_y, torsion, shear_x: 5.0 / 6.0 * flanges / area, shear_y: plate / area })
}

/// Stiffness and inertia of a beam's section, about its centroid and principal axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// `diag K = (EJx, EJy, GJ, ax GA, ay GA, EA)`: N m^2 three times, then N three times.
    pub stiffness: [f64; 6],
    /// Inertia per length `rho (Jx, Jy, Jx + Jy, A, A, A)`: kg m three times, then kg/m three times.
    pub inertia: [f64; 6],
}

impl Section {
    /// The section of this shape and material.
    ///
    /// Twist resists with the torsion constant of Saint-Venant and moves with the polar moment, which differ unless the section is round.
    pub fn new(shape: Shape, material: Material) -> Result<Self> {
        material.check()?;
        let Properties { area, moment_x, moment_y, torsion, shear_x, shear_y } = shape.properties(material.poisson)?;
        let (young, shear, density) = (material.young, material.shear(), material.density);
        let across = [shear_x, shear_y].map(|factor| factor * shear * area);
        let line = density * area;
        let [turn_x, turn_y] = [moment_x, moment_y].map(|moment| density * moment);
        Ok(Self {
            stiffness: [young * moment_x, young * moment_y, shear * torsion, across[0], across[1], young * area],
            inertia: [turn_x, turn_y, turn_x + turn_y, line, line, line],
        })
    }

    /// A section known by its stiffness and its inertia per length; the units are those of the fields.
    ///
    /// Checked: stiffness and mass positive, rotary inertia not negative, one mass for all directions.
    pub fn given(stiffness: [f64; 6], inertia: [f64; 6]) -> Result<Self> {
        for value in stiffness {
            positive("section.stiffness", value)?;
        }
        for &value in &inertia[..3] {
            not_negative("section.inertia", value)?;
        }
        for &value in &inertia[3..] {
            positive("section.inertia", value)?;
            if value != inertia[3] {
                let condition = "be the same mass per length in all three directions";
                return Err(Error::Domain { path: "section.inertia".to_owned(), condition, value });
            }
        }
        Ok(Self { stiffness, inertia })
    }

    /// Mass per length in kg/m.
    pub fn line_density(&self) -> f64 {
        self.inertia[3]
    }
}
