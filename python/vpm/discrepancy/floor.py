"""How small the gap could be at best: measurement noise carried through the same comparison."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vpm.experiment import Experiment, noise_std
from vpm.identify import InverseDynamicsProblem, gaps
from vpm.model import Model

Array = NDArray[np.float64]

#: Seed of the noise that is carried through; any would do.
SEED = 20160331


def noise_floor(model: Model, experiments: tuple[Experiment, ...], cutoffs: tuple[float, ...]) -> dict[str, float]:
    """Root mean square that sensor noise alone leaves in the balance of effort, by channel.

    Noise of the estimated size is added to the measured motion once more; what that changes in the residual is the
    floor. Commands are taken as exact: the controller wrote them.

    Parameters
    ----------
    model : Model
        The best model found; its masses turn noise of acceleration into effort.
    experiments : tuple of Experiment
    cutoffs : tuple of float
        Cut-off frequency of each record's motion filter, Hz.
    """
    generator = np.random.default_rng(SEED)
    power: dict[str, list[tuple[float, int]]] = {}
    for experiment, cutoff in zip(experiments, cutoffs, strict=True):
        clean = InverseDynamicsProblem(model, [experiment], cutoff=cutoff)
        noisy = InverseDynamicsProblem(model, [_with_noise(model, experiment, generator)], cutoff=cutoff)
        change = noisy.evaluate(model, model.theta)[0] - clean.evaluate(model, model.theta)[0]
        for channel, (rms, _, _) in gaps(clean, change).items():
            power.setdefault(channel, []).append((rms**2, change.size))
    return {c: float(np.sqrt(np.average([p for p, _ in v], weights=[n for _, n in v]))) for c, v in power.items()}


def _with_noise(model: Model, experiment: Experiment, generator: np.random.Generator) -> Experiment:
    for joint in model.joints:
        for quantity in ("position", "velocity", "acceleration"):
            channel = f"{joint}.{quantity}"
            if channel in experiment:
                values = experiment[channel]
                noise = noise_std(values) * generator.standard_normal(values.size)
                unit = experiment.units[experiment.channels.index(channel)]
                experiment = experiment.with_channel(channel, values + noise, unit)
    return experiment
