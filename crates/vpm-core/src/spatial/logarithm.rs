//! The rotation vector of a rotation.

use super::{Matrix3, Vector3};
use crate::scalar::Scalar;

impl<S: Scalar> Matrix3<S> {
    /// Logarithm of a rotation matrix: axis times angle in rad, the angle from 0 to pi.
    ///
    /// Law: through the unit quaternion `(w, v)`, `angle = 2 atan(|v| / w)` along v. The quaternion comes from its largest component
    /// (Shepperd 1978, "Quaternion from rotation matrix", J. Guidance and Control 1(3)), so that no digit is lost at any angle.
    /// Checked: it undoes [`Matrix3::rotation`]; at half a turn the sign of the axis is arbitrary.
    pub fn rotation_vector(self) -> Vector3<S> {
        let [w, x, y, z] = self.quaternion();
        let [w, x, y, z] = w.if_negative(|| [-w, -x, -y, -z], || [w, x, y, z]);
        let v = Vector3::new(x, y, z);
        let (square, small) = (v.dot(v), w * 1e-4 * w);
        // Each way works with numbers that it could have, also where the other one counts.
        let near = || {
            // The series of atan(t) / t in t^2, so that derivatives hold at zero.
            let w = w.max(S::from_f64(0.5));
            let x = square / (w * w);
            let series = (0..9).rev().fold(S::zero(), |sum, k| {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                sum * x + sign / f64::from(2 * k + 1)
            });
            series * 2.0 / w
        };
        let far = || {
            let size = square.max(small).sqrt();
            let [short, long] = size.if_less(w, || [size, w], || [w, size]);
            let angle = (short / long).atan();
            size.if_less(w, || angle, || -angle + std::f64::consts::FRAC_PI_2) * 2.0 / size
        };
        v * square.if_less(small, near, far)
    }

    /// Unit quaternion for the logarithm of a rotation, its scalar part first.
    fn quaternion(self) -> [S; 4] {
        let [x, y, z] = self.columns;
        let trace = x.x + y.y + z.z;
        let (minus, plus) =
            (Vector3::new(y.z - z.y, z.x - x.z, x.y - y.x), Vector3::new(y.z + z.y, z.x + x.z, x.y + y.x));
        let sizes = [trace, x.x, y.y, z.z];
        // Four times the square of the largest component, 1 + 2 (its diagonal entry) - trace or 1 + trace, and four times its products
        // with the others.
        let [square, a, b, c] = at_largest(sizes, |k| match k {
            0 => [trace + 1.0, minus.x, minus.y, minus.z],
            1 => [x.x * 2.0 - trace + 1.0, minus.x, plus.z, plus.y],
            2 => [y.y * 2.0 - trace + 1.0, minus.y, plus.z, plus.x],
            _ => [z.z * 2.0 - trace + 1.0, minus.z, plus.y, plus.x],
        });
        let main = square.sqrt();
        let other = (main * 2.0).recip();
        let (main, [a, b, c]) = (main * 0.5, [a, b, c].map(|product| product * other));
        at_largest(sizes, |k| match k {
            0 => [main, a, b, c],
            1 => [a, main, b, c],
            2 => [a, b, main, c],
            _ => [a, b, c, main],
        })
    }
}

/// Value of `of` at the largest of four numbers, for the logarithm; the first of equal ones.
fn at_largest<S: Scalar>(sizes: [S; 4], of: impl Fn(usize) -> [S; 4]) -> [S; 4] {
    let better = |(most, found): (S, [S; 4]), k: usize| most.if_less(sizes[k], || (sizes[k], of(k)), || (most, found));
    (1..4).fold((sizes[0], of(0)), better).1
}
