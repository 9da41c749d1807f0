"""Samples for the plots of a diagnosis, of the first validation record; masked samples are NaN."""

from __future__ import annotations

import numpy as np

from vpm.compare import compare
from vpm.discrepancy.confirmation.confirmation import Data, Judged
from vpm.discrepancy.diagnosis import Picture, Trace
from vpm.identify import InverseDynamicsProblem
from vpm.model import Model
from vpm.numbers import stretches
from vpm.simulate import Run


def traces(data: Data, nominal: Judged, final: Judged) -> tuple[Trace, ...]:
    """Samples for the plot of simulated and measured channels of the first validation record."""
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
    """Samples for the residual plots, one for each joint of the first validation record."""
    found = []
    problem = data.validation
    position, velocity, _ = problem.state(0)
    _, applied, _ = problem.effort(final.model, final.model.theta, 0)
    for joint, block in enumerate(problem.efforts(0)):
        counts = np.where(block.moving > 0.0, 1.0, np.nan)
        residuals = [counts * j.validation[block.samples] / block.weight for j in (nominal, recalibrated, final)]
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


def where(model: Model, validation: InverseDynamicsProblem) -> dict[str, tuple[str, ...]]:
    """Sentences on the residual by state region, for each channel of the first validation record."""
    time, applied, required = validation.effort(model, model.theta, 0)
    record, sentences = validation.experiments[0], {}
    for joint, block in enumerate(validation.efforts(0)):
        parts = [part for part in stretches(block.moving > 0.0) if part.stop - part.start > 1]
        if not parts:
            continue
        rows = np.concatenate([np.arange(part.start, part.stop) for part in parts])
        starts = np.cumsum([0, *(part.stop - part.start for part in parts[:-1])]).astype(np.int64)
        columns = (required[rows, joint : joint + 1], applied[rows, joint : joint + 1])
        run = Run(
            model.name, record.name, "inverse_dynamics", time[rows], (block.channel,), (block.unit,), *columns, starts
        )
        (found,) = compare(run, record, [block.channel]).channels
        # Unlike in multi-step predictions, the state is not reset where a stretch begins.
        sentences[block.channel] = tuple(r.sentence for r in found.where.regions if r.quantity != "time since restart")
    return sentences
