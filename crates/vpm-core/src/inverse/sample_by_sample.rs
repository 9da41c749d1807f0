//! A function of a machine along a record in numbers with derivatives, where its derivative is too large to be recorded.

use super::record::{PATIENCE, Record};
use crate::error::Result;
use crate::motion::position_sensors;
use crate::scalar::Scalar;
use crate::sensitivity::{Job, Pair};
use crate::system::{Kind, Routine};

/// The function `kind`, of `width` numbers.
pub(super) struct SampleBySample<'a> {
    pub(super) record: Record<'a>,
    pub(super) kind: Kind,
    pub(super) width: usize,
}

impl Job for SampleBySample<'_> {
    fn run<S: Scalar>(&self, theta: &[S]) -> Result<Pair<S>> {
        let Record { description, motion, .. } = self.record;
        let values: Vec<f64> = theta.iter().map(Scalar::inspect).collect();
        let mut routine = Routine::new(description.functions().function(&self.kind, &values)?, theta);
        let (sensors, mut memories) = (position_sensors(description, theta), description.memories_of(theta));
        let (n, first) = (sensors.len(), description.n_states() - memories.len());
        let mut state = vec![S::zero(); description.n_states()];
        let (mut a, mut before) = (vec![S::zero(); n], vec![S::zero(); n]);
        let mut numbers = vec![S::zero(); motion.position.rows() * self.width];
        for (k, row) in numbers.chunks_exact_mut(self.width.max(1)).enumerate() {
            if k.is_multiple_of(PATIENCE) {
                self.record.ask()?;
            }
            for joint in 0..n {
                [state[joint], state[n + joint], a[joint]] = self.record.behind(k, joint, &sensors);
            }
            if k > 0 {
                memories.travel(self.record.time_step, |joint| state[joint] - before[joint]);
            }
            before.copy_from_slice(&state[..n]);
            state[first..].copy_from_slice(memories.values());
            routine.put_accelerations(&a);
            row.copy_from_slice(routine.at(&state));
        }
        Ok(Pair { first: numbers, second: Vec::new() })
    }
}
