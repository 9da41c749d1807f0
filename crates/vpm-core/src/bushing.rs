//! An elastic connection of two frames in all six directions.

mod entry;

pub use entry::{BushingEnd, BushingEntry};

use serde::Deserialize;

use crate::effect::Domain;
use crate::scalar::Scalar;
use crate::spatial::{Matrix3, Pose, Twist, Vector3, Wrench};

/// A bushing between a frame A and a frame B: stiffness and damping in all six directions, with any coupling between them.
///
/// Displacement: `d = [phi; t]` in the axes of B, from the pose `X_BA` of A in B: phi is the rotation vector of `R_BA` (axis times angle,
/// rad), t the place of A's origin (m). It is meant for angles below half a turn, where phi jumps.
/// Law: the forces that belong to d are `[m; f] = -K d - C dd/dt + w_0`, in N m and N. The wrench on A has the force f and the moment
/// `J^T m` with `dphi/dt = J omega`, J the inverse of the tangent map of the rotation vector; so for symmetric K the potential
/// `d^T K d / 2 - w_0^T d` holds at every angle, not only at small ones. For small angles J is 1 and the law is the printed one.
/// The wrench on B is the opposite one: force `-F_A`, moment `-T_A - t x F_A`.
/// Entries are in the order `[angular; linear]` of all spatial vectors; the thesis lists the translations first.
/// Source: eqs 3.39 and 3.40 of the thesis, with the cross product, the sign of the damping and the preload `w_0` put right; J from
/// Barfoot 2017, "State Estimation for Robotics", chapter 7.
/// Checked: equal and opposite about any point, energy gradient, power balance, and the same in all axes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bushing<P> {
    /// K by rows: N m/rad, N/rad, N and N/m.
    pub stiffness: [[P; 6]; 6],
    /// C by rows: N m s/rad, N s/rad, N s and N s/m.
    pub damping: [[P; 6]; 6],
    /// `w_0`, what acts on A without displacement: N m, N.
    pub preload: [P; 6],
}

/// What a bushing does to its two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BushingWrenches<S> {
    /// On the body of A: about A's origin, in A's axes.
    pub on_a: Wrench<S>,
    /// On the body of B: about B's origin, in B's axes.
    pub on_b: Wrench<S>,
}

impl<P> Bushing<P> {
    /// Bushing over another number type.
    pub fn map<T>(&self, f: &mut impl FnMut(&P) -> T) -> Bushing<T> {
        Bushing {
            stiffness: self.stiffness.each_ref().map(|row| row.each_ref().map(&mut *f)),
            damping: self.damping.each_ref().map(|row| row.each_ref().map(&mut *f)),
            preload: self.preload.each_ref().map(&mut *f),
        }
    }

    /// Parameters of a bushing and where each is defined: entries on the diagonals are not negative.
    pub fn domains(&self) -> Vec<(&P, Domain)> {
        let entry = |(k, entry)| (entry, if k % 7 == 0 { Domain::NonNegative } else { Domain::Any });
        let matrices = [&self.stiffness, &self.damping];
        let entries = matrices.into_iter().flat_map(|matrix| matrix.as_flattened().iter().enumerate().map(entry));
        entries.chain(self.preload.iter().map(|entry| (entry, Domain::Any))).collect()
    }
}

impl<S: Scalar> Bushing<S> {
    /// Bushing without coupling and preload: the six entries of each diagonal, `[angular; linear]`.
    pub fn diagonal(stiffness: [S; 6], damping: [S; 6]) -> Self {
        let matrix = |entries: [S; 6]| {
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { entries[i] } else { S::zero() }))
        };
        Self { stiffness: matrix(stiffness), damping: matrix(damping), preload: [S::zero(); 6] }
    }

    /// Displacement d of a bushing at the pose `X_BA`: rotation vector in rad and place in m.
    pub fn displacement(pose: &Pose<S>) -> [S; 6] {
        stacked(pose.rotation.rotation_vector(), pose.translation)
    }

    /// Rate of a bushing's displacement for a twist of A against B: `V_A - X_BA^-1 V_B`. The twist is at A's origin in
    /// A's axes.
    pub fn displacement_rate(pose: &Pose<S>, motion: Twist<S>) -> [S; 6] {
        let phi = pose.rotation.rotation_vector();
        stacked(inverse_tangent(phi, 0.5, motion.angular), pose.rotation * motion.linear)
    }

    /// The wrenches on both bodies at the pose `X_BA` and the motion of A against B (as in [`Bushing::displacement_rate`]).
    pub fn wrenches(&self, pose: &Pose<S>, motion: Twist<S>) -> BushingWrenches<S> {
        let (d, rate) = (Self::displacement(pose), Self::displacement_rate(pose, motion));
        let [mx, my, mz, fx, fy, fz]: [S; 6] = std::array::from_fn(|i| {
            self.preload[i] - product(&self.stiffness[i], &d) - product(&self.damping[i], &rate)
        });
        let phi = Vector3::new(d[0], d[1], d[2]);
        let moment = inverse_tangent(phi, -0.5, Vector3::new(mx, my, mz));
        let on_a = Wrench::new(moment, pose.rotation.transpose_mul(Vector3::new(fx, fy, fz)));
        BushingWrenches { on_a, on_b: -pose.wrench(on_a) }
    }

    /// Potential energy of a bushing in J at the pose `X_BA`, for symmetric K; zero without displacement.
    pub fn potential(&self, pose: &Pose<S>) -> S {
        let d = Self::displacement(pose);
        let spring = self.stiffness.iter().zip(&d).map(|(row, &entry)| product(row, &d) * entry).sum::<S>();
        spring * 0.5 - product(&self.preload, &d)
    }

    /// Power in W that a bushing loses, `(dd/dt)^T C dd/dt`.
    pub fn dissipation(&self, pose: &Pose<S>, motion: Twist<S>) -> S {
        let rate = Self::displacement_rate(pose, motion);
        self.damping.iter().zip(&rate).map(|(row, &entry)| product(row, &rate) * entry).sum()
    }
}

#[inline]
fn stacked<S: Scalar>(angular: Vector3<S>, linear: Vector3<S>) -> [S; 6] {
    let ([a, b, c], [x, y, z]) = (angular.to_array(), linear.to_array());
    [a, b, c, x, y, z]
}

#[inline]
fn product<S: Scalar>(row: &[S; 6], column: &[S; 6]) -> S {
    row.iter().zip(column).map(|(&left, &right)| left * right).sum()
}

/// Inverse tangent of a bushing's rotation, `J w = w + half phi x w + g phi x (phi x w)`. With `g = (1 - (a/2)
/// cot(a/2)) / a^2` and a = |phi|: for an angular velocity in the axes of A with `half = 1/2`, its transpose with `half
/// = -1/2`.
#[inline]
fn inverse_tangent<S: Scalar>(phi: Vector3<S>, half: f64, w: Vector3<S>) -> Vector3<S> {
    let square = phi.dot(phi);
    let factor = square.if_less(S::from_f64(0.1), || series(square), || closed(square));
    let skew = Matrix3::skew(phi);
    let once = skew * w;
    w + once * S::from_f64(half) + skew * once * factor
}

/// Series in a^2 for g of a bushing (Bernoulli numbers), so that derivatives hold at zero. What is left out is below
/// rounding.
fn series<S: Scalar>(square: S) -> S {
    let terms = [12.0, 720.0, 30240.0, 1_209_600.0, 47_900_160.0, 1_307_674_368_000.0 / 691.0, 74_724_249_600.0];
    terms.into_iter().rev().fold(S::zero(), |sum, term: f64| sum * square + term.recip())
}

/// Closed form for g of a bushing.
fn closed<S: Scalar>(square: S) -> S {
    let half = square.sqrt() * 0.5;
    let (sine, cosine) = half.sin_cos();
    (-(half * cosine / sine) + 1.0) / square
}
