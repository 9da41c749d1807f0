//! The equations of motion of a planar chain.

use super::chain::PlanarChain;
use super::link::{Integrals, Point};
use crate::scalar::Scalar;

/// Coordinates and rates of a chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion<S, const ALL: usize> {
    /// Coordinates: rad and 1/m.
    pub position: [S; ALL],
    /// Their rates, per s.
    pub velocity: [S; ALL],
}

/// A load on the tip of the last link, in the fixed axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Force in N.
    pub force: [f64; 2],
    /// Moment in N m.
    pub moment: f64,
}

/// `M a + bias = Q`, without elasticity and joint torques.
#[derive(Clone, Copy, Debug)]
pub struct Terms<S, const ALL: usize> {
    /// Mass matrix M, both triangles.
    pub mass: [[S; ALL]; ALL],
    /// Velocity terms and gravity less the load on the tip, counted as loads.
    pub bias: [S; ALL],
}

/// The buffers of one evaluation.
#[derive(Clone, Debug)]
pub struct Workspace<S, const LINKS: usize, const EACH: usize> {
    points: Vec<Point<S, EACH>>,
    integrals: [Integrals<S, EACH>; LINKS],
}

impl<const LINKS: usize, const EACH: usize, const ALL: usize> PlanarChain<LINKS, EACH, ALL> {
    /// Buffers for this chain.
    pub fn workspace<S: Scalar>(&self) -> Workspace<S, LINKS, EACH> {
        let mut points = vec![Point::zero(); self.points];
        let rest = [S::zero(); EACH];
        let integrals = std::array::from_fn(|i| self.links[i].integrals(&rest, &rest, &mut points));
        Workspace { points, integrals }
    }

    /// Mass matrix and bias in a state.
    ///
    /// Gravity enters as an acceleration of the base that all share. Accelerations sum up from the base to the tip, forces
    /// from the tip to the base: `bias_i = int rhoA J_i^T b_i ds + (int rhoA J_i ds)^T A_i + J_tip,i^T F_i`, `A_i` the acceleration of joint
    /// i at zero coordinate accelerations and `F_i` the inertia force of all that hangs on the tip of link i.
    #[inline]
    pub fn terms<S: Scalar>(
        &self,
        motion: &Motion<S, ALL>,
        load: &Load,
        workspace: &mut Workspace<S, LINKS, EACH>,
    ) -> Terms<S, ALL> {
        for (i, (link, integrals)) in self.links.iter().zip(&mut workspace.integrals).enumerate() {
            let x = slice(&motion.position, i);
            *integrals = link.integrals(&x, &slice(&motion.velocity, i), &mut workspace.points);
        }
        Terms { mass: self.mass(&workspace.integrals), bias: self.bias(&workspace.integrals, load) }
    }

    fn mass<S: Scalar>(&self, integrals: &[Integrals<S, EACH>; LINKS]) -> [[S; ALL]; ALL] {
        let mut mass = [[S::zero(); ALL]; ALL];
        for (i, own) in integrals.iter().enumerate() {
            let beyond = self.mass_beyond[i];
            let mut moment = own.moment;
            for (sum, &tip) in moment.as_flattened_mut().iter_mut().zip(own.tip.jacobian.as_flattened()) {
                *sum += tip * beyond;
            }
            for k in 0..EACH {
                let [tip_x, tip_y] = own.tip.jacobian.map(|row| row[k] * beyond);
                for l in 0..EACH {
                    let carried = tip_x * own.tip.jacobian[0][l] + tip_y * own.tip.jacobian[1][l];
                    mass[i * EACH + k][i * EACH + l] = own.mass[k][l] + carried + self.links[i].rotary[k][l];
                }
            }
            for (j, before) in integrals.iter().enumerate().take(i) {
                let [x, y] = &before.tip.jacobian;
                for k in 0..EACH {
                    for l in 0..EACH {
                        let entry = moment[0][k] * x[l] + moment[1][k] * y[l];
                        mass[i * EACH + k][j * EACH + l] = entry;
                        mass[j * EACH + l][i * EACH + k] = entry;
                    }
                }
            }
        }
        mass
    }

    fn bias<S: Scalar>(&self, integrals: &[Integrals<S, EACH>; LINKS], load: &Load) -> [S; ALL] {
        let mut base = [[S::zero(); 2]; LINKS];
        let mut acceleration = self.gravity.map(|component| S::from_f64(-component));
        for (base, own) in base.iter_mut().zip(integrals) {
            *base = acceleration;
            acceleration = std::array::from_fn(|axis| acceleration[axis] + own.tip.acceleration[axis]);
        }
        let mut force = load.force.map(|component| S::from_f64(-component));
        let mut bias = [S::zero(); ALL];
        for (i, own) in integrals.iter().enumerate().rev() {
            let line = self.links[i].mass();
            for axis in 0..2 {
                force[axis] += (base[i][axis] + own.tip.acceleration[axis]) * self.tip_mass[i];
            }
            for k in 0..EACH {
                let shared = own.moment[0][k] * base[i][0] + own.moment[1][k] * base[i][1];
                let carried = own.tip.jacobian[0][k] * force[0] + own.tip.jacobian[1][k] * force[1];
                bias[i * EACH + k] = own.bias[k] + shared + carried;
            }
            for axis in 0..2 {
                force[axis] += base[i][axis] * line + own.force[axis];
            }
        }
        for (entry, row) in bias[(LINKS - 1) * EACH..].iter_mut().zip(self.links[LINKS - 1].tip_row) {
            *entry -= S::from_f64(load.moment * row);
        }
        bias
    }

    /// The tip of every link in m, and the angle there in rad, by the same quadrature as the dynamics.
    pub fn tips<S: Scalar>(&self, position: &[S; ALL]) -> [[S; 3]; LINKS] {
        let mut place = [S::zero(); 2];
        std::array::from_fn(|i| {
            let x = slice(position, i);
            let [step_x, step_y] = self.links[i].reach(&x);
            place = [place[0] + step_x, place[1] + step_y];
            let angle = x.iter().zip(self.links[i].tip_row).map(|(&x, row)| x * row).sum();
            [place[0], place[1], angle]
        })
    }
}

fn slice<S: Scalar, const EACH: usize>(all: &[S], link: usize) -> [S; EACH] {
    std::array::from_fn(|k| all[link * EACH + k])
}
