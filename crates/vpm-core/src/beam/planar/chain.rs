//! What a planar chain consists of.

use super::link::Link;
use crate::beam::linear::{Plane, TipBody};
use crate::beam::{Basis, Section, not_negative, positive};
use crate::error::Result;

/// A rigid hub around the joint of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hub {
    /// Distance from the joint to the clamp of the beam in m.
    pub radius: f64,
    /// Mass in kg, centred on the joint.
    pub mass: f64,
    /// Moment of inertia about the joint in kg m^2.
    pub inertia: f64,
}

/// The parameters of one flexible link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkParameters {
    /// Bending stiffness EJ in N m^2.
    pub bending: f64,
    /// Mass per length rhoA in kg/m.
    pub line: f64,
    /// Rotary inertia per length rhoJ in kg m; zero for an Euler-Bernoulli beam.
    pub rotary: f64,
    /// Kelvin-Voigt damping: the bending moment is `EJ (kappa + damping kappa_t)`; in s.
    pub damping: f64,
    /// The hub.
    pub hub: Hub,
    /// The body at the tip.
    pub tip: TipBody,
}

impl LinkParameters {
    /// An Euler-Bernoulli link of that section, deflected along `plane`, without damping, hub or tip body.
    pub fn new(section: &Section, plane: Plane) -> Self {
        let about = if plane == Plane::X { 1 } else { 0 };
        let bending = section.stiffness[about];
        let line = section.line_density();
        Self { bending, line, rotary: 0.0, damping: 0.0, hub: Hub::default(), tip: TipBody::default() }
    }

    pub(super) fn check(&self) -> Result<()> {
        positive("link.bending", self.bending)?;
        positive("link.line", self.line)?;
        for (path, value) in [
            ("link.rotary", self.rotary),
            ("link.damping", self.damping),
            ("link.hub.radius", self.hub.radius),
            ("link.hub.mass", self.hub.mass),
            ("link.hub.inertia", self.hub.inertia),
            ("link.tip.mass", self.tip.mass),
            ("link.tip.inertia", self.tip.inertia),
        ] {
            not_negative(path, value)?;
        }
        Ok(())
    }
}

/// A chain of `LINKS` flexible links with `EACH` coordinates each, `ALL = LINKS * EACH` together.
///
/// The coordinates of link `i` stand at `[i EACH .. (i + 1) EACH]`: the absolute angle of its hub in rad, then the coefficients of its
/// curvature in 1/m.
#[derive(Clone, Debug)]
pub struct PlanarChain<const LINKS: usize, const EACH: usize, const ALL: usize> {
    pub(super) links: [Link<EACH>; LINKS],
    /// Mass that the tip of a link carries: its body and the hub of the next link, in kg.
    pub(super) tip_mass: [f64; LINKS],
    /// The same with all that comes after, in kg.
    pub(super) mass_beyond: [f64; LINKS],
    pub(super) gravity: [f64; 2],
    pub(super) points: usize,
}

impl<const LINKS: usize, const EACH: usize, const ALL: usize> PlanarChain<LINKS, EACH, ALL> {
    /// A chain with its joint in the origin under `gravity` (m/s^2); `points` Gauss stations integrate over each link.
    ///
    /// Each link brings its parameters and the basis of its curvature, which must have `EACH - 1` functions.
    pub fn new(links: [(LinkParameters, Basis); LINKS], gravity: [f64; 2], points: usize) -> Result<Self> {
        const { assert!(EACH > 0 && LINKS > 0 && ALL == LINKS * EACH) };
        for component in gravity {
            not_negative("chain.gravity", component.abs())?;
        }
        let tip_mass = std::array::from_fn(|i| {
            let next = links.get(i + 1).map_or(0.0, |(parameters, _)| parameters.hub.mass);
            links[i].0.tip.mass + next
        });
        let built = links.into_iter().map(|(parameters, basis)| Link::new(parameters, basis, points));
        let built: Vec<Link<EACH>> = built.collect::<Result<_>>()?;
        let mut mass_beyond = tip_mass;
        for i in (0..LINKS - 1).rev() {
            mass_beyond[i] += built[i + 1].mass() + mass_beyond[i + 1];
        }
        let links = std::array::from_fn(|i| built[i].clone());
        Ok(Self { links, tip_mass, mass_beyond, gravity, points })
    }

    /// Length of link `link` from its clamp to its tip, in m.
    pub fn length(&self, link: usize) -> f64 {
        self.links[link].length()
    }

    /// The row of the angle of joint `link` over all coordinates: hub angle less the angle of the tip before.
    pub fn joint_row(&self, link: usize) -> [f64; ALL] {
        let mut row = [0.0; ALL];
        row[link * EACH] = 1.0;
        if let Some(before) = link.checked_sub(1) {
            for (entry, tip) in row[before * EACH..].iter_mut().zip(self.links[before].tip_row) {
                *entry = -tip;
            }
        }
        row
    }

    /// The row of the curvature (1/m) of link `link` at `s` (m) from its clamp.
    ///
    /// The strain of the surface at distance z from the neutral axis is z times the curvature.
    pub fn curvature_row(&self, link: usize, s: f64) -> [f64; ALL] {
        let mut row = [0.0; ALL];
        row[link * EACH + 1..(link + 1) * EACH].copy_from_slice(&self.links[link].basis.evaluate(s, 0));
        row
    }

    /// Elastic stiffness over all coordinates, and the Kelvin-Voigt damping that goes with it.
    pub fn elasticity(&self) -> [[[f64; ALL]; ALL]; 2] {
        let mut matrices = [[[0.0; ALL]; ALL]; 2];
        for (i, link) in self.links.iter().enumerate() {
            for (k, row) in link.stiffness.iter().enumerate() {
                for (l, &entry) in row.iter().enumerate() {
                    matrices[0][i * EACH + k][i * EACH + l] = entry;
                    matrices[1][i * EACH + k][i * EACH + l] = entry * link.parameters.damping;
                }
            }
        }
        matrices
    }
}
