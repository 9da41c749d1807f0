//! The rotation vector of a rotation.

use super::{Matrix3, Vector3};
use crate::scalar::Scalar;

impl<S: Scalar> Matrix3<S> {
    /// The rotation vector of a rotation matrix: axis times angle in rad, the angle from 0 to pi.
    ///
    /// Law: through the unit quaternion `(w, v)`, `angle = 2 atan(|v| / w)` along v. The quaternion comes from its largest component
    /// (Shepperd 1978, "Quaternion from rotation matrix", J. Guidance and Control 1(3)), so that no digit is lost at any angle.
    /// Checked: it undoes [`Matrix3::rotation`]; at half a turn the sign of the axis is arbitrary.
    pub fn rotation_vector(self) -> Vector3<S> {
        let (w, v) = self.quaternion();
        let (w, v) = if w.re() < 0.0 { (-w, -v) } else { (w, v) };
        let square = v.dot(v);
        if square.re() < 1e-4 * w.re() * w.re() {
            // The series of atan(t) / t in t^2, so that derivatives hold at zero.
            let x = square / (w * w);
            let series = (0..9).rev().fold(S::zero(), |sum, k| {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                sum * x + sign / f64::from(2 * k + 1)
            });
            return v * (series * 2.0 / w);
        }
        let size = square.sqrt();
        let half =
            if size.re() < w.re() { (size / w).atan() } else { -(w / size).atan() + std::f64::consts::FRAC_PI_2 };
        v * (half * 2.0 / size)
    }

    /// Scalar and vector part of the unit quaternion.
    fn quaternion(self) -> (S, Vector3<S>) {
        let [x, y, z] = self.columns;
        let trace = x.x + y.y + z.z;
        let (minus, plus) =
            (Vector3::new(y.z - z.y, z.x - x.z, x.y - y.x), Vector3::new(y.z + z.y, z.x + x.z, x.y + y.x));
        let largest = [trace, x.x, y.y, z.z].map(|entry| entry.re());
        let best = (1..4).fold(0, |best, k| if largest[k] > largest[best] { k } else { best });
        // Four times the square of the largest component is 1 + 2 (its diagonal entry) - trace, or 1 + trace.
        let square = match best {
            0 => trace + 1.0,
            1 => x.x * 2.0 - trace + 1.0,
            2 => y.y * 2.0 - trace + 1.0,
            _ => z.z * 2.0 - trace + 1.0,
        };
        let main = square.sqrt();
        let other = (main * 2.0).recip();
        let main = main * 0.5;
        match best {
            0 => (main, minus * other),
            1 => (minus.x * other, Vector3::new(main, plus.z * other, plus.y * other)),
            2 => (minus.y * other, Vector3::new(plus.z * other, main, plus.x * other)),
            _ => (minus.z * other, Vector3::new(plus.y * other, plus.x * other, main)),
        }
    }
}
