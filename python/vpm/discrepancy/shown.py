"""Samples of the first unseen record for the pictures of a diagnosis; what does not count is NaN."""

from __future__ import annotations

import numpy as np

from vpm.discrepancy.confirmation import Data, Judged
from vpm.discrepancy.diagnosis import Picture, Trace


def traces(data: Data, nominal: Judged, final: Judged) -> tuple[Trace, ...]:
    """Channels of the first unseen record as they were simulated to judge by."""
    problem = data.simulation
    if problem is None or final.simulated is None:
        return ()
    record = problem.experiments[0]
    found = []
    for block in problem.blocks[: len(problem.blocks) // len(problem.experiments)]:
        measured = np.interp(block.time, record.time, record[block.channel])
        counts = np.where(block.moving > 0.0, 1.0, np.nan)
        simulated = [
            np.full(measured.shape, np.nan)
            if stage.simulated is None
            else measured - counts * stage.simulated[block.samples] / block.weight
            for stage in (nominal, final)
        ]
        found.append(Trace(record.name, block.channel, block.unit, problem.mode, block.time, measured, *simulated))
    return tuple(found)


def pictures(data: Data, nominal: Judged, recalibrated: Judged, final: Judged) -> tuple[Picture, ...]:
    """One for each joint of the first unseen record."""
    found = []
    problem = data.unseen
    position, velocity, _ = problem.state(0)
    _, applied, _ = problem.effort(final.model, final.model.theta, 0)
    for joint, block in enumerate(problem.efforts(0)):
        counts = np.where(block.moving > 0.0, 1.0, np.nan)
        residuals = [counts * j.unseen[block.samples] / block.weight for j in (nominal, recalibrated, final)]
        unit = final.model.channel_unit(block.channel.replace(".effort", ".position"))
        found.append(
            Picture(
                block.channel,
                block.unit,
                unit,
                block.time,
                position[:, joint],
                velocity[:, joint],
                applied[:, joint],
                *residuals,
            )
        )
    return tuple(found)
