//! Wrenches on frames of a machine, and what they do to its coordinates.

use crate::data::{Composite, Data};
use crate::model::{Elastic, Model};
use crate::scalar::Scalar;
use crate::spatial::Wrench;

/// Adds to `loads` what a wrench on a frame, about its origin and in its axes, does to the coordinates, after [`super::frames`].
///
/// Law: `J^T F`, read joint by joint on the way to the world: `tau = S . F`, `F_P = X_PF F` (the inward half of Featherstone 2008, table
/// 5.1; a beam is a joint of as many coordinates). Checked: against the Jacobian of a marker on the frame.
pub(crate) fn add_wrench<S: Scalar>(
    model: &Model<S>,
    data: &Data<S>,
    mut frame: usize,
    mut wrench: Wrench<S>,
    loads: &mut [S],
) {
    let Composite { frames, sections, .. } = &data.composite;
    while frame != 0 {
        let across = &frames[frame].across;
        frame = match model.links().get(frame - 1) {
            Some(link) => {
                loads[frame - 1] += link.kind.effort(&wrench);
                link.parent
            }
            None => {
                let Some((number, station)) = model.station(frame) else { return };
                let Elastic { beam, root, coordinate, .. } = &model.beams()[number];
                let columns = &sections[number].columns[station * beam.len()..(station + 1) * beam.len()];
                for (load, column) in loads[*coordinate..].iter_mut().zip(columns) {
                    *load += column.power(wrench);
                }
                root.frame
            }
        };
        if frame != 0 {
            wrench = across.wrench(wrench);
        }
    }
}
