//! The constant quadratic forms of a beam's second-order kinematics.

use std::ops::Range;

use crate::beam::fields::Fields;
use crate::beam::quadrature::composite;

/// A quadratic form and which entry of `(w, v)` it adds to.
#[derive(Clone, Debug)]
pub(super) struct Form {
    /// 0 to 2: rotation vector; 3 to 5: displacement.
    pub target: usize,
    /// Coordinates that each coordinate couples with; none if it takes no part.
    pub partners: Vec<Option<Range<usize>>>,
}

/// All forms of a beam.
#[derive(Clone, Debug)]
pub(super) struct Forms {
    /// Which there are.
    pub targets: Vec<Form>,
    /// Their matrices, station by station, form by form, row by row.
    pub matrices: Vec<f64>,
}

/// First-order fields at a point, each as a row over the coordinates.
struct Point {
    /// Rotation.
    theta: [Vec<f64>; 3],
    /// Curvatures and twist.
    kappa: [Vec<f64>; 3],
    /// Shears and extension.
    gamma: [Vec<f64>; 3],
}

/// Sums of the forms along the axis, each `n x n`: second-order rotation, its integral (for x and y), displacement.
struct Sums {
    n: usize,
    rotation: [Vec<f64>; 3],
    displacement: [Vec<f64>; 3],
}

impl Forms {
    /// The forms at `places`, ascending.
    ///
    /// Law: `R' = R [kappa]x` and `r' = R (k + gamma)` to second order, `w_2' = 1/2 theta x kappa` (Iserles et al. 2000, "Lie-group
    /// methods", Acta Numerica 9, section 4.1) and `v_2' = w_2 x k + 1/2 theta x (theta x k) + theta x gamma`; in one plane all that is left
    /// is the shortening `v_z' = -1/2 v_x'^2`. Checked: against the exponentials of the strain beam, to third order.
    pub fn new(fields: &Fields, places: &[f64]) -> Self {
        let n = fields.len();
        let mut sums =
            Sums { n, rotation: [0; 3].map(|_| vec![0.0; n * n]), displacement: [0; 3].map(|_| vec![0.0; n * n]) };
        let (mut dense, mut begin) = (Vec::with_capacity(places.len()), 0.0);
        for &place in places {
            let inside = fields.breaks().into_iter().filter(|&at| at > begin && at < place);
            for end in inside.chain([place]).collect::<Vec<_>>() {
                sums.advance(fields, begin, end);
                begin = end;
            }
            dense.push(sums.symmetric());
        }
        Self::packed(n, &dense)
    }

    /// Leaves out forms that are zero everywhere and notes who couples with whom.
    fn packed(n: usize, dense: &[[Vec<f64>; 6]]) -> Self {
        let mut targets = Vec::new();
        for target in 0..6 {
            let couples = |i: usize, j: usize| dense.iter().any(|forms| forms[target][i * n + j] != 0.0);
            let partners: Vec<Option<Range<usize>>> = (0..n)
                .map(|i| {
                    let first = (0..n).find(|&j| couples(i, j))?;
                    let last = (first..n).rev().find(|&j| couples(i, j))?;
                    Some(first..last + 1)
                })
                .collect();
            if partners.iter().any(Option::is_some) {
                targets.push(Form { target, partners });
            }
        }
        let matrices = dense.iter().flat_map(|forms| targets.iter().flat_map(|form| forms[form.target].clone()));
        let matrices = matrices.collect();
        Self { targets, matrices }
    }
}

impl Sums {
    /// Goes on from `begin` to `end`, between which all fields are polynomials.
    fn advance(&mut self, fields: &Fields, begin: f64, end: f64) {
        // The integral of w_2 over the piece: what has come about before, and what comes about in it with its lever to the end.
        for (target, source, sign) in [(0, 1, 1.0), (1, 0, -1.0)] {
            let before = self.rotation[source].iter();
            for (sum, entry) in self.displacement[target].iter_mut().zip(before) {
                *sum += sign * (end - begin) * entry;
            }
        }
        for at in composite(fields.points() + 1, &[begin, end]) {
            let Point { theta, kappa, gamma } = Point::new(fields, at.place);
            let (weight, lever) = (at.weight, at.weight * (end - at.place));
            for (a, b, c) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
                for (left, right, sign) in [(b, c, 0.5), (c, b, -0.5)] {
                    self.add(a, weight * sign, &theta[left], &kappa[right]);
                    // w_2 x k = (w_2y, -w_2x, 0), integrated once more.
                    match a {
                        0 => self.add(4, -lever * sign, &theta[left], &kappa[right]),
                        1 => self.add(3, lever * sign, &theta[left], &kappa[right]),
                        _ => {}
                    }
                    self.add(3 + a, 2.0 * weight * sign, &theta[left], &gamma[right]);
                }
            }
            self.add(3, 0.5 * weight, &theta[2], &theta[0]);
            self.add(4, 0.5 * weight, &theta[2], &theta[1]);
            self.add(5, -0.5 * weight, &theta[0], &theta[0]);
            self.add(5, -0.5 * weight, &theta[1], &theta[1]);
        }
    }

    /// Adds `factor left^T right` to a form.
    fn add(&mut self, target: usize, factor: f64, left: &[f64], right: &[f64]) {
        let matrix = if target < 3 { &mut self.rotation[target] } else { &mut self.displacement[target - 3] };
        for (row, &left) in matrix.chunks_exact_mut(self.n).zip(left).filter(|(_, left)| **left != 0.0) {
            for (entry, &right) in row.iter_mut().zip(right) {
                *entry += factor * left * right;
            }
        }
    }

    /// The matrices `A + A^T`, so that the forms are `1/2 q^T (A + A^T) q`.
    fn symmetric(&self) -> [Vec<f64>; 6] {
        let n = self.n;
        let [a, b, c] = &self.rotation;
        let [d, e, f] = &self.displacement;
        [a, b, c, d, e, f].map(|form| (0..n * n).map(|at| form[at] + form[at % n * n + at / n]).collect())
    }
}

impl Point {
    fn new(fields: &Fields, mu: f64) -> Self {
        let n = fields.len();
        let empty = || [0; 3].map(|_| vec![0.0; n]);
        let (mut theta, mut kappa, mut gamma) = (empty(), empty(), empty());
        let rotation = fields.row(mu, |component| usize::from(component.bends()));
        let strain = fields.strain_row(mu);
        for (k, &component) in fields.components.iter().enumerate() {
            match component {
                0 => theta[0][k] = -rotation[k],
                1 | 2 => theta[component][k] = rotation[k],
                _ => {}
            }
            match component {
                0..3 => kappa[component][k] = strain[k],
                _ => gamma[component - 3][k] = strain[k],
            }
        }
        Self { theta, kappa, gamma }
    }
}
