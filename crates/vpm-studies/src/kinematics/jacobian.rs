//! Velocities and accelerations of a chain, by differentiation and by screws: two routes that share only the geometry.

use super::{Motion, SerialChain};
use vpm_core::scalar::{Dual, Scalar};
use vpm_core::spatial::{Matrix3, Pose, Twist, Vector3};

impl SerialChain {
    /// The conventional Jacobian: column k is the tool's angular velocity and velocity per unit rate of coordinate k.
    ///
    /// Law: partial derivatives of the pose, `v = dp/dq_k` and `[w]x = dR/dq_k R^T`, exact by dual numbers. Source: eqs
    /// 2.32 and 2.25. Gives the pose as well; allocates nothing. Checked: against [`SerialChain::screw_jacobian`].
    pub fn conventional_jacobian<S: Scalar>(&self, q: &[S], columns: &mut [Twist<S>]) -> Pose<S> {
        debug_assert!(q.len() == self.n_coordinates() && columns.len() == q.len());
        for (lane, column) in columns.iter_mut().enumerate() {
            let coordinate = |k: usize| if k == lane { Dual::variable(q[k], 0) } else { Dual::constant(q[k]) };
            *column = rate(&self.walk::<Dual<S, 1>>(coordinate, |_, _, _| ()));
        }
        self.pose(q)
    }

    /// The screw Jacobian `[$_1 .. $_n]`: column k is joint k's unit screw, in world axes at the world's origin.
    ///
    /// Source: eq 2.34. Gives the tool's pose as well; allocates nothing. The tool's velocity follows by [`at_point`].
    pub fn screw_jacobian<S: Scalar>(&self, q: &[S], columns: &mut [Twist<S>]) -> Pose<S> {
        debug_assert!(q.len() == self.n_coordinates() && columns.len() == q.len());
        self.walk(|k| q[k], |k, _, screw| columns[k] = screw)
    }

    /// Tool motion without a Jacobian: its pose differentiated twice along the motion `q`, `v`, `a`.
    ///
    /// Law: `J a + J_dot v`, which is `phi_q a + phi_q_dot v + phi_t_dot = 0` with `phi = x - f(q)` (eq 2.37 with the
    /// signs corrected), exact by nested dual numbers. `a = 0` gives `J_dot v`. Checked: against
    /// [`SerialChain::motion_by_screws`].
    pub fn motion_by_differentiation<S: Scalar>(&self, q: &[S], v: &[S], a: &[S]) -> Motion<S> {
        debug_assert!(q.len() == self.n_coordinates() && v.len() == q.len() && a.len() == q.len());
        let time = |k: usize| Dual {
            value: Dual { value: q[k], gradient: [v[k]] },
            gradient: [Dual { value: v[k], gradient: [a[k]] }],
        };
        second_order(&self.walk::<Dual<Dual<S, 1>, 1>>(time, |_, _, _| ()))
    }

    /// Tool motion by the Jacobian: sums over the screws.
    ///
    /// Law: `V = sum $_i v_i` (eq 2.33), `V_dot = sum $_i a_i + sum_(i<j) v_i v_j [$_i, $_j]` (eq 2.38), with the
    /// bracket of two screws; the double sum is gathered joint by joint, since `sum_(i<j) v_i $_i` is the velocity
    /// before joint j.
    pub fn motion_by_screws<S: Scalar>(&self, q: &[S], v: &[S], a: &[S]) -> Motion<S> {
        debug_assert!(q.len() == self.n_coordinates() && v.len() == q.len() && a.len() == q.len());
        let (mut velocity, mut acceleration) = (Twist::zero(), Twist::zero());
        let pose = self.walk(
            |k| q[k],
            |k, _, screw| {
                acceleration += screw * a[k] + velocity.cross(screw) * v[k];
                velocity += screw * v[k];
            },
        );
        let tip = at_point(velocity, pose.translation);
        // The origin's velocity v_O = p_dot - w x p, so p_ddot = a_O + alpha x p + w x p_dot.
        let mut tip_acceleration = at_point(acceleration, pose.translation);
        tip_acceleration.linear += velocity.angular.cross(tip.linear);
        Motion { pose, velocity: tip, acceleration: tip_acceleration }
    }
}

/// Velocity of a body in another of its points, for the Jacobian: `v_p = v_O + w x p`.
pub fn at_point<S: Scalar>(twist: Twist<S>, point: Vector3<S>) -> Twist<S> {
    Twist::new(twist.angular, twist.linear + twist.angular.cross(point))
}

/// Angular velocity and velocity of a frame whose pose carries its time derivative, beside the Jacobian.
///
/// Law: `w = 1/2 sum c x c_dot` over the columns of R, the vector of `R_dot R^T` (eq 2.25).
fn rate<S: Scalar>(pose: &Pose<Dual<S, 1>>) -> Twist<S> {
    let angular = pose.rotation.columns.iter().fold(Vector3::zero(), |sum, column| {
        sum + map(column, |entry| entry.value).cross(map(column, |entry| entry.gradient[0]))
    });
    Twist::new(angular * S::from_f64(0.5), map(&pose.translation, |entry| entry.gradient[0]))
}

/// Motion of a frame whose pose carries two time derivatives, beside the Jacobian.
///
/// The derivative of `w = 1/2 sum c x c_dot` is `1/2 sum c x c_ddot`.
fn second_order<S: Scalar>(pose: &Pose<Dual<Dual<S, 1>, 1>>) -> Motion<S> {
    let now = |entry: Dual<Dual<S, 1>, 1>| entry.value.value;
    let first = |entry: Dual<Dual<S, 1>, 1>| entry.value.gradient[0];
    let second = |entry: Dual<Dual<S, 1>, 1>| entry.gradient[0].gradient[0];
    let half = S::from_f64(0.5);
    let spin = |part: &dyn Fn(Dual<Dual<S, 1>, 1>) -> S| {
        let columns = pose.rotation.columns.iter();
        columns.fold(Vector3::zero(), |sum, column| sum + map(column, now).cross(map(column, part))) * half
    };
    let [x, y, z] = pose.rotation.columns.map(|column| map(&column, now));
    Motion {
        pose: Pose::new(Matrix3::from_columns(x, y, z), map(&pose.translation, now)),
        velocity: Twist::new(spin(&first), map(&pose.translation, first)),
        acceleration: Twist::new(spin(&second), map(&pose.translation, second)),
    }
}

fn map<A: Scalar, B: Scalar>(vector: &Vector3<A>, part: impl Fn(A) -> B) -> Vector3<B> {
    Vector3::new(part(vector.x), part(vector.y), part(vector.z))
}
