//! Where the joints of an arm should be over time.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use vpm_core::beam::planar::Reference;

use crate::arrays::Numbers;

type Any<'py> = Bound<'py, PyAny>;

/// Where the joints should be.
pub(super) enum Course {
    /// Amplitude (rad) and period (s) of each joint: `amplitude / 2 (1 - cos(2 pi t / period))`.
    Swing(Vec<[f64; 2]>),
    /// Angles, then rates, of all joints at equal distances in time; a cubic between.
    Sampled { time_step: f64, rows: usize, values: Vec<f64> },
}

impl Course {
    /// From the arguments of a run over `duration` (s), exactly one of which is given.
    pub(super) fn new(
        joints: usize,
        swing: Option<&Any<'_>>,
        reference: Option<&Any<'_>>,
        time_step: f64,
        duration: f64,
    ) -> PyResult<Self> {
        match (swing, reference) {
            (Some(swing), None) => {
                let rows = Numbers::table("swing", swing)?.rows_of::<2>()?;
                let good = rows.len() == joints
                    && rows.iter().all(|row| row[0].is_finite() && row[1].is_finite() && row[1] > 0.0);
                if good {
                    return Ok(Self::Swing(rows));
                }
                let text =
                    format!("`swing` needs an amplitude and a positive period for each of {joints} joints; give both");
                Err(PyValueError::new_err(text))
            }
            (None, Some(reference)) => {
                let numbers = Numbers::table("reference", reference)?;
                let (rows, values) = (numbers.rows(), numbers.values().to_vec());
                if rows < 2 || values.len() != rows * 2 * joints || values.iter().any(|value| !value.is_finite()) {
                    return Err(PyValueError::new_err(format!(
                        "`reference` needs two rows at least, of {joints} angles and {joints} rates, all finite; fill the gaps"
                    )));
                }
                let end = (rows - 1) as f64 * time_step;
                if !(time_step > 0.0 && duration <= end * (1.0 + 1e-9)) {
                    return Err(PyValueError::new_err(format!(
                        "the reference ends at {end} s, before the run of {duration} s; give more rows or a shorter duration"
                    )));
                }
                Ok(Self::Sampled { time_step, rows, values })
            }
            _ => Err(PyValueError::new_err("a run needs either `swing` or `reference`; give exactly one of them")),
        }
    }

    /// All joints at time `t` (s).
    pub(super) fn at<const LINKS: usize>(&self, t: f64) -> [Reference; LINKS] {
        match self {
            Self::Swing(rows) => std::array::from_fn(|i| {
                let [amplitude, period] = rows[i];
                let (half, speed) = (0.5 * amplitude, std::f64::consts::TAU / period);
                let (sin, cos) = (speed * t).sin_cos();
                Reference { angle: half * (1.0 - cos), rate: half * speed * sin }
            }),
            Self::Sampled { time_step, rows, values } => {
                let k = ((t / time_step) as usize).min(rows - 2);
                let share = (t / time_step - k as f64).clamp(0.0, 1.0);
                let row = |k: usize| &values[k * 2 * LINKS..(k + 1) * 2 * LINKS];
                std::array::from_fn(|i| {
                    let (a, b) = (row(k)[i], row(k + 1)[i]);
                    cubic([a, b], [row(k)[LINKS + i], row(k + 1)[LINKS + i]], *time_step, share)
                })
            }
        }
    }
}

/// The cubic through two values with given slopes, `share` of the way between them.
fn cubic([a, b]: [f64; 2], [da, db]: [f64; 2], h: f64, share: f64) -> Reference {
    let slope = (b - a) / h;
    let (c2, c3) = (3.0 * slope - 2.0 * da - db, da + db - 2.0 * slope);
    let angle = a + h * share * (da + share * (c2 + share * c3));
    Reference { angle, rate: da + share * (2.0 * c2 + 3.0 * share * c3) }
}
