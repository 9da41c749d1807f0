//! The constant quadratic forms of a beam's second-order kinematics, summed up along its axis.

use std::ops::Range;

use crate::beam::fields::Fields;
use crate::beam::quadrature::composite;
use crate::scalar::Scalar;

/// The forms as sums of what each segment between neighbouring sections adds; only coordinates that bend a segment take part in it.
#[derive(Clone, Debug)]
pub(super) struct Forms {
    n: usize,
    /// Which entries of `(w, v)` have a form: 0 to 2 rotation vector, 3 to 5 displacement.
    targets: Vec<usize>,
    /// The coordinates from the first to the last that take part in each.
    spans: Vec<Range<usize>>,
    segments: Vec<Segment>,
}

/// What a segment adds to the forms.
#[derive(Clone, Debug)]
struct Segment {
    size: f64,
    /// The coordinates that bend it.
    local: Vec<usize>,
    /// Rows of symmetric matrices that are not zero.
    rows: Vec<Row>,
    entries: Vec<f64>,
}

/// A row of a matrix.
#[derive(Clone, Debug)]
struct Row {
    /// Place of the form among the targets.
    form: usize,
    coordinate: usize,
    /// The local coordinates that it couples with; none for those between which there is nothing.
    partners: Range<usize>,
    /// Its entries.
    entries: Range<usize>,
}

/// Values of the forms at a section: `1/2 q^T A q`, its rate, and the rate of that at constant coordinate rates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Second<S> {
    pub value: [S; 6],
    pub rate: [S; 6],
    pub change: [S; 6],
}

/// First-order fields at a point, each as a row over the local coordinates.
struct Point {
    weight: f64,
    /// Distance to the end of the segment.
    lever: f64,
    /// Rotation.
    theta: [Vec<f64>; 3],
    /// Curvatures and twist.
    kappa: [Vec<f64>; 3],
    /// Shears and extension.
    gamma: [Vec<f64>; 3],
}

impl<S: Scalar> Second<S> {
    /// The forms at the root.
    pub fn zero() -> Self {
        let zero = [S::zero(); 6];
        Self { value: zero, rate: zero, change: zero }
    }
}

impl Forms {
    /// The forms at `places`, ascending.
    ///
    /// Law: `R' = R [kappa]x` and `r' = R (k + gamma)` to second order, `w_2' = 1/2 theta x kappa` (Iserles et al. 2000, "Lie-group
    /// methods", Acta Numerica 9, section 4.1) and `v_2' = w_2 x k + 1/2 theta x (theta x k) + theta x gamma`; in one plane all that is left
    /// is the shortening `v_z' = -1/2 v_x'^2`. Checked: against the exponentials of the strain beam, to third order.
    pub fn new(fields: &Fields, places: &[f64]) -> Self {
        let mut begin = 0.0;
        let mut dense = Vec::with_capacity(places.len());
        for &place in places {
            dense.push(segment(fields, begin, place));
            begin = place;
        }
        let here = |target: usize| dense.iter().any(|(.., blocks)| blocks[target].iter().any(|&entry| entry != 0.0));
        let targets: Vec<usize> = (0..6).filter(|&target| here(target)).collect();
        let segments: Vec<Segment> =
            dense.into_iter().map(|(size, local, blocks)| Segment::packed(size, local, &blocks, &targets)).collect();
        let span = |form: usize| {
            // A rotation leans on into the displacement across it.
            let from = |own: usize| own == form || matches!((targets[own], targets[form]), (1, 3) | (0, 4));
            let all = segments.iter().flat_map(|segment| &segment.rows).filter(|row| from(row.form));
            all.fold(fields.len()..0, |span, row| span.start.min(row.coordinate)..span.end.max(row.coordinate + 1))
        };
        let spans = (0..targets.len()).map(span).collect();
        Self { n: fields.len(), targets, spans, segments }
    }

    /// How many derivatives of forms there are.
    pub fn slopes(&self) -> usize {
        self.targets.len() * self.n
    }

    /// Derivatives of the forms by the coordinates, with the entry of `(w, v)` each belongs to and the first coordinate.
    pub fn rows<'a, S>(&'a self, slopes: &'a [S]) -> impl Iterator<Item = (usize, usize, &'a [S])> {
        let each = self.targets.iter().zip(&self.spans).zip(slopes.chunks_exact(self.n));
        each.map(|((&target, span), slopes)| (target, span.start, &slopes[span.clone()]))
    }

    /// Goes on across a segment; `slopes` are the derivatives of the forms by the coordinates.
    pub fn advance<S: Scalar>(&self, number: usize, (q, v): (&[S], &[S]), second: &mut Second<S>, slopes: &mut [S]) {
        let Segment { size, local, rows, entries } = &self.segments[number];
        self.lean(*size, second, slopes);
        for row in rows {
            let (mut slope, mut change) = (S::zero(), S::zero());
            for (&j, &entry) in local[row.partners.clone()].iter().zip(&entries[row.entries.clone()]) {
                slope += q[j] * entry;
                change += v[j] * entry;
            }
            let (i, target) = (row.coordinate, self.targets[row.form]);
            slopes[row.form * self.n + i] += slope;
            second.value[target] += q[i] * slope * 0.5;
            second.rate[target] += v[i] * slope;
            second.change[target] += v[i] * change;
        }
    }

    /// Displacement by a rotation before the segment in the quadratic forms: `w_2 x k = (w_2y, -w_2x, 0)`.
    fn lean<S: Scalar>(&self, size: f64, second: &mut Second<S>, slopes: &mut [S]) {
        for (turn, shift, lever) in [(1, 3, size), (0, 4, -size)] {
            let place = |target| self.targets.iter().position(|&own| own == target);
            let (Some(from), Some(to)) = (place(turn), place(shift)) else { continue };
            for six in [&mut second.value, &mut second.rate, &mut second.change] {
                six[shift] += six[turn] * lever;
            }
            for k in self.spans[from].clone() {
                let slope = slopes[from * self.n + k] * lever;
                slopes[to * self.n + k] += slope;
            }
        }
    }
}

impl Segment {
    /// Quadratic forms without zero entries.
    fn packed(size: f64, local: Vec<usize>, blocks: &[Vec<f64>; 6], targets: &[usize]) -> Self {
        let (m, mut rows, mut entries) = (local.len(), Vec::new(), Vec::new());
        for (form, &target) in targets.iter().enumerate() {
            for (row, &coordinate) in blocks[target].chunks_exact(m.max(1)).zip(&local) {
                let Some(first) = row.iter().position(|&entry| entry != 0.0) else { continue };
                let last = row.iter().rposition(|&entry| entry != 0.0).unwrap_or(first);
                let begin = entries.len();
                entries.extend(&row[first..=last]);
                rows.push(Row { form, coordinate, partners: first..last + 1, entries: begin..entries.len() });
            }
        }
        Self { size, local, rows, entries }
    }
}

/// Size, coordinates and symmetric matrices of what the beam between two places adds to the forms.
fn segment(fields: &Fields, begin: f64, end: f64) -> (f64, Vec<usize>, [Vec<f64>; 6]) {
    let inside = fields.breaks().into_iter().filter(|&at| at > begin && at < end);
    let breaks: Vec<f64> = std::iter::once(begin).chain(inside).chain([end]).collect();
    let rule = composite(fields.points() + 1, &breaks);
    let rows: Vec<_> = rule
        .iter()
        .map(|at| {
            let rotation = fields.row(at.place, |component| usize::from(component.bends()));
            [rotation, fields.strain_row(at.place)]
        })
        .collect();
    let bends = |&k: &usize| rows.iter().flatten().any(|row| row[k] != 0.0);
    let local: Vec<usize> = (0..fields.len()).filter(bends).collect();
    let m = local.len();
    let mut sums = [0; 6].map(|_| vec![0.0; m * m]);
    for (at, [rotation, strain]) in rule.iter().zip(&rows) {
        let pick = |row: &[f64]| -> Vec<f64> { local.iter().map(|&k| row[k]).collect() };
        let components: Vec<usize> = local.iter().map(|&k| fields.components[k]).collect();
        Point::new(&components, &pick(rotation), &pick(strain), (at.weight, end - at.place)).add(&mut sums);
    }
    // A + A^T, so that the forms are 1/2 q^T (A + A^T) q.
    let symmetric = sums.map(|form| (0..m * m).map(|at| form[at] + form[at % m * m + at / m]).collect());
    (end - begin, local, symmetric)
}

impl Point {
    fn new(components: &[usize], rotation: &[f64], strain: &[f64], (weight, lever): (f64, f64)) -> Self {
        let empty = || [0; 3].map(|_| vec![0.0; components.len()]);
        let (mut theta, mut kappa, mut gamma) = (empty(), empty(), empty());
        for (k, &component) in components.iter().enumerate() {
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
        Self { weight, lever, theta, kappa, gamma }
    }

    /// Adds cross products at the point to the quadratic forms, term by term.
    fn add(&self, sums: &mut [Vec<f64>; 6]) {
        let Self { weight, lever, theta, kappa, gamma } = self;
        for (a, b, c) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            for (left, right, sign) in [(b, c, 0.5 * weight), (c, b, -0.5 * weight)] {
                outer(&mut sums[a], sign, &theta[left], &kappa[right]);
                outer(&mut sums[3 + a], 2.0 * sign, &theta[left], &gamma[right]);
                // w_2 x k = (w_2y, -w_2x, 0), integrated once more.
                match a {
                    0 => outer(&mut sums[4], -lever * sign, &theta[left], &kappa[right]),
                    1 => outer(&mut sums[3], lever * sign, &theta[left], &kappa[right]),
                    _ => {}
                }
            }
        }
        outer(&mut sums[3], 0.5 * weight, &theta[2], &theta[0]);
        outer(&mut sums[4], 0.5 * weight, &theta[2], &theta[1]);
        outer(&mut sums[5], -0.5 * weight, &theta[0], &theta[0]);
        outer(&mut sums[5], -0.5 * weight, &theta[1], &theta[1]);
    }
}

/// Adds `factor left^T right` to a quadratic form.
fn outer(matrix: &mut [f64], factor: f64, left: &[f64], right: &[f64]) {
    for (row, &left) in matrix.chunks_exact_mut(right.len().max(1)).zip(left).filter(|(_, left)| **left != 0.0) {
        for (entry, &right) in row.iter_mut().zip(right) {
            *entry += factor * left * right;
        }
    }
}
