//! Clamped beams at small deflections: constant matrices, natural frequencies, static deflections, stiffening by rotation.

use nalgebra::{DMatrix, DVector};

use crate::beam::eigen::{self, Modes};
use crate::beam::quadrature::composite;
use crate::beam::{Basis, Section, dimension, not_negative};
use crate::error::{Error, Result};

/// Direction of the deflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// Along x: bending about y.
    X,
    /// Along y: bending about x.
    Y,
}

/// What turns with the section, and against what it resists.
#[derive(Clone, Debug, PartialEq)]
pub enum Theory {
    /// Shear-rigid, the rotation is the slope `v'`; sections have no rotary inertia.
    EulerBernoulli,
    /// Shear-rigid, with rotary inertia.
    Rayleigh,
    /// Shear-flexible: the rotation is a field of its own, interpolated by this basis, which must vanish at the root.
    Timoshenko(Basis),
}

/// A rigid body at the tip, its centre of mass on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipBody {
    /// Mass in kg.
    pub mass: f64,
    /// Moment of inertia about the axis of bending in kg m^2.
    pub inertia: f64,
}

/// Bending of a clamped beam in one plane, coordinates `q = (deflection, rotation)`.
///
/// With slope angle `theta` (`theta_y` for deflection along x, `-theta_x` along y): `E_k = 1/2 int rhoA v_t^2 + rhoJ theta_t^2 dmu`,
/// `E_p = 1/2 int EJ theta'^2 + aGA (v' - theta)^2 dmu`, without the last term and with `theta = v'` in shear-rigid beams. Source:
/// Timoshenko, Young & Weaver 1974, "Vibration Problems in Engineering", chapter 5; Selig & Ding 2009 for the strain screw.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearBeam {
    deflection: Basis,
    theory: Theory,
    bending: f64,
    shear: f64,
    line: f64,
    rotary: f64,
    tip: TipBody,
}

/// The fields at one station, as rows over the coordinates.
struct Fields {
    weight: f64,
    mu: f64,
    deflection: DVector<f64>,
    slope: DVector<f64>,
    rotation: DVector<f64>,
    curvature: DVector<f64>,
}

impl LinearBeam {
    /// Linear beam whose deflection `basis` is clamped at the root. It has to be in value and slope if shear-rigid, in
    /// value otherwise.
    pub fn new(section: &Section, plane: Plane, basis: Basis, theory: Theory, tip: TipBody) -> Result<Self> {
        not_negative("tip.mass", tip.mass)?;
        not_negative("tip.inertia", tip.inertia)?;
        let (about, across) = match plane {
            Plane::X => (1, 3),
            Plane::Y => (0, 4),
        };
        let beam = Self {
            deflection: basis,
            theory,
            bending: section.stiffness[about],
            shear: section.stiffness[across],
            line: section.line_density(),
            rotary: section.inertia[about],
            tip,
        };
        beam.check_root().map(|()| beam)
    }

    fn check_root(&self) -> Result<()> {
        let root = |basis: &Basis, order| basis.evaluate(0.0, order).iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let loose = match &self.theory {
            Theory::Timoshenko(rotation) => root(&self.deflection, 0).max(root(rotation, 0)),
            _ => root(&self.deflection, 0).max(root(&self.deflection, 1) * self.deflection.length()),
        };
        if loose < 1e-9 {
            return Ok(());
        }
        let condition = "vanish at the clamped root, with their slope if the beam is shear-rigid".to_owned();
        let repair = "use a clamped Bernstein or Hermite basis";
        Err(Error::Setting { setting: "the shape functions of a beam", condition, value: loose, repair })
    }

    /// Number of coordinates of the linear beam.
    pub fn len(&self) -> usize {
        self.deflection.len() + if let Theory::Timoshenko(rotation) = &self.theory { rotation.len() } else { 0 }
    }

    /// Whether the linear beam has no coordinate at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Fields of the linear beam at `mu`; differentiated once more where the theory asks.
    fn fields(&self, mu: f64, weight: f64) -> Fields {
        let n = self.len();
        let lead = |order| DVector::from_vec(self.deflection.evaluate(mu, order)).resize_vertically(n, 0.0);
        let (rotation, curvature) = match &self.theory {
            Theory::Timoshenko(rotation) => {
                let trail = |order| {
                    let mut row = DVector::zeros(n);
                    row.rows_mut(n - rotation.len(), rotation.len()).copy_from_slice(&rotation.evaluate(mu, order));
                    row
                };
                (trail(0), trail(1))
            }
            _ => (lead(1), lead(2)),
        };
        Fields { weight, mu, deflection: lead(0), slope: lead(1), rotation, curvature }
    }

    /// Gauss stations that integrate products of two fields of the linear beam exactly.
    fn stations(&self) -> Vec<Fields> {
        let other = if let Theory::Timoshenko(rotation) = &self.theory { rotation.points() } else { 0 };
        let points = self.deflection.points().max(other) + 1;
        composite(points, &self.deflection.breaks()).into_iter().map(|s| self.fields(s.place, s.weight)).collect()
    }

    /// Mass matrix of the linear beam, tip body included.
    pub fn mass(&self) -> DMatrix<f64> {
        let rotary = if self.theory == Theory::EulerBernoulli { 0.0 } else { self.rotary };
        let mut mass = DMatrix::zeros(self.len(), self.len());
        for at in self.stations() {
            add_square(&mut mass, at.weight * self.line, &at.deflection);
            add_square(&mut mass, at.weight * rotary, &at.rotation);
        }
        let tip = self.fields(self.deflection.length(), 1.0);
        add_square(&mut mass, self.tip.mass, &tip.deflection);
        add_square(&mut mass, self.tip.inertia, &tip.rotation);
        mass
    }

    /// Elastic stiffness matrix of the linear beam.
    pub fn stiffness(&self) -> DMatrix<f64> {
        let mut stiffness = DMatrix::zeros(self.len(), self.len());
        for at in self.stations() {
            add_square(&mut stiffness, at.weight * self.bending, &at.curvature);
            if matches!(self.theory, Theory::Timoshenko(_)) {
                add_square(&mut stiffness, at.weight * self.shear, &(&at.slope - &at.rotation));
            }
        }
        stiffness
    }

    /// Second-order shortening of the linear beam: `v_z(mu) = -1/2 int_0^mu v'^2 = -1/2 q^T S(mu) q`.
    ///
    /// Source: Kane, Ryan & Banerjee 1987, "Dynamics of a cantilever beam attached to a moving base", J. Guidance 10(2).
    pub fn shortening(&self, mu: f64) -> DMatrix<f64> {
        let mut breaks: Vec<f64> = self.deflection.breaks().into_iter().filter(|&place| place < mu).collect();
        breaks.push(mu);
        let mut form = DMatrix::zeros(self.len(), self.len());
        for station in composite(self.deflection.points(), &breaks) {
            add_square(&mut form, station.weight, &self.fields(station.place, 0.0).slope);
        }
        form
    }

    /// Geometric stiffness of the linear beam under axial `tension(mu)` in N: `int tension v'^2 dmu`.
    pub fn geometric_stiffness(&self, tension: impl Fn(f64) -> f64) -> DMatrix<f64> {
        let mut stiffness = DMatrix::zeros(self.len(), self.len());
        for at in self.stations() {
            add_square(&mut stiffness, at.weight * tension(at.mu), &at.slope);
        }
        stiffness
    }

    /// Centrifugal stiffness of the linear beam per squared speed, in kg; `hub` (m) before the root. It turns about an
    /// axis across it.
    ///
    /// Multiplied with `Omega^2` it is what the shortening does against the centrifugal force: `int rhoA (hub + mu) S(mu) dmu`, tip
    /// included. Deflection along the axis of rotation (flap) has this stiffness in addition to the elastic one, deflection in the
    /// plane of rotation (lag) this less `mass()`, whose radial lever grows with the deflection.
    pub fn centrifugal(&self, hub: f64) -> DMatrix<f64> {
        let length = self.deflection.length();
        let tip = self.tip.mass * (hub + length);
        self.geometric_stiffness(|mu| tip + self.line * (length - mu) * (hub + 0.5 * (length + mu)))
    }

    /// Natural frequencies and modes of the linear beam, with an `extra` stiffness (N/m) if one is given.
    pub fn modes(&self, extra: Option<&DMatrix<f64>>) -> Result<Modes> {
        let mut stiffness = self.stiffness();
        if let Some(extra) = extra {
            dimension("the rows of the extra stiffness", self.len(), extra.nrows(), "coordinate")?;
            dimension("the columns of the extra stiffness", self.len(), extra.ncols(), "coordinate")?;
            stiffness += extra;
        }
        eigen::modes(&stiffness, &self.mass())
    }

    /// Static deflection of the linear beam under a `force` (N) across the tip and a `moment` (N m) on it.
    pub fn static_deflection(&self, force: f64, moment: f64) -> Result<DVector<f64>> {
        let tip = self.fields(self.deflection.length(), 1.0);
        eigen::solve(&self.stiffness(), &(tip.deflection * force + tip.rotation * moment))
    }

    /// Deflection (m), rotation (rad) and curvature (1/m) of the linear beam at `mu`.
    ///
    /// The strain of the surface at distance z from the neutral axis is z times the curvature.
    pub fn at(&self, mu: f64, coordinates: &DVector<f64>) -> [f64; 3] {
        let at = self.fields(mu, 1.0);
        [at.deflection.dot(coordinates), at.rotation.dot(coordinates), at.curvature.dot(coordinates)]
    }

    /// Modal basis of the linear beam: the `count` slowest modes of a shear-rigid beam.
    pub fn modal_basis(&self, count: usize) -> Result<Basis> {
        if matches!(self.theory, Theory::Timoshenko(_)) || count == 0 || count > self.len() {
            let condition = format!("lie between 1 and {}, on a shear-rigid beam", self.len());
            let repair = "ask for fewer modes, or make the modes of a shear-rigid beam";
            return Err(Error::Setting { setting: "the number of modes", condition, value: count as f64, repair });
        }
        Basis::combination(self.deflection.clone(), self.modes(None)?.shapes.columns(0, count).into_owned())
    }
}

/// Adds `factor row row^T` to a matrix of the linear beam.
fn add_square(matrix: &mut DMatrix<f64>, factor: f64, row: &DVector<f64>) {
    matrix.ger(factor, row, row, 1.0);
}
