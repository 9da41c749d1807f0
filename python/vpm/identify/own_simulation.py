"""What a balance of effort leaves of a simulation of the model itself: no fault of the model, but of the comparison.

Positions are filtered and differentiated, commands are held, encoders are noisy. Where friction turns round the filter
blurs what it should not, and a balance is not zero even at the true parameters: they come out biased by several of
their deviations. A fit must find in the model's own simulation what was put into it. So the fitted model is simulated
on the commands of the log, with noise like that of its encoders, and what the balance leaves of that is taken off what
it leaves of the log (C. Gouriéroux, A. Monfort, E. Renault, "Indirect inference", *J. Applied Econometrics* 8, 1993;
B. Efron and R. Tibshirani, *An Introduction to the Bootstrap*, 1993, chapter 10).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.experiment import Experiment, Motion, noise_std
from vpm.identify.along import has_hidden, has_own_drives
from vpm.identify.balance import InverseDynamicsProblem
from vpm.model import Model
from vpm.simulate import HOLDS
from vpm.stepping import Simulation

Array = NDArray[np.float64]

#: Bandwidths with which a simulation is drawn to its log, Hz: the slower, the less it hears of the noise of the log.
BANDS = (0.3, 1.0, 3.0)
#: Damping of that.
DAMPING = float(np.sqrt(0.5))
#: Share of its motion by which a joint may be away from its log.
AWAY = 0.3
#: Where dry friction turns round, longer steps would be an error of the simulation that a fit takes for the machine's.
METHOD = "adaptive(1e-7)"
#: A model that leaves so many times more of a log than of its own simulation lacks something, which is more than this.
ALIKE = 2.0
#: Simulated logs with noise of their own; their mean adds a part of the variance that is one over their number.
DRAWS = 6


def own_residual(model: Model, data: InverseDynamicsProblem, seed: int = 0) -> Array | None:
    """What ``data`` leaves of simulations of ``model`` on the commands of its records, shape (n,).

    Parameters
    ----------
    model : Model
        At the values of a fit.
    data : InverseDynamicsProblem
    seed : int
        Of the noise.

    Returns
    -------
    ndarray or None
        None where the model does not stay by its records or lacks something, or has states that these do not show.
    """
    held = data.hold == HOLDS[0]
    if not held or has_own_drives(model) or any(has_hidden(model, m.joints) for m in data.motions):
        return None
    try:
        made = [_simulated(model, e, m) for e, m in zip(data.experiments, data.motions, strict=True)]
    except (VpmError, ArithmeticError):
        return None
    simulated = [one for one in made if one is not None]
    if len(simulated) < len(made):
        return None
    levels, random, left = [_noise(e) for e in data.experiments], np.random.default_rng(seed), []
    for _ in range(DRAWS):
        noisy = [_noisy(one, level, random) for one, level in zip(simulated, levels, strict=True)]
        # What is relative to the delivered effort is made so afterwards, with what is expected taken off.
        left.append(InverseDynamicsProblem.evaluate(data.on(noisy), model, model.theta)[0])
    of_log = InverseDynamicsProblem.evaluate(data, model, model.theta)[0]
    if not np.linalg.norm(of_log) <= ALIKE * np.linalg.norm(left) / np.sqrt(DRAWS):
        return None
    return np.asarray(np.mean(left, axis=0))


def _simulated(model: Model, log: Experiment, m: Motion) -> Experiment | None:
    """The log as the model would have written it without noise; None where the model does not stay by it."""
    for band in BANDS:
        made = _drawn(model, log, m, band)
        channels = [f"{joint}.position" for joint in model.joints]
        if all(np.std(made[channel] - log[channel]) <= AWAY * np.std(log[channel]) for channel in channels):
            return made
    return None


def _drawn(model: Model, log: Experiment, m: Motion, band: float) -> Experiment:
    """A simulation on the commands of a log, to which a slow controller adds what keeps it by the motion of the log."""
    omega, joints = 2.0 * np.pi * band, len(model.joints)
    gains = _commands_per_effort(model, m) @ model.mass_matrix(np.mean(m.position, axis=0))
    start = {f"{joint}.position": m.position[0, n] for n, joint in enumerate(model.joints)}
    start |= {f"{joint}.velocity": m.velocity[0, n] for n, joint in enumerate(model.joints)}
    sim = Simulation(model, m.dt, integrator=METHOD, state=start, compiled=True)
    places = [sim.channels.index(f"{joint}.position") for joint in model.joints]
    positions, commands = np.empty_like(m.position), np.empty_like(m.inputs)
    for k, (position, velocity, command) in enumerate(zip(m.position, m.velocity, m.inputs, strict=True)):
        positions[k] = sim.outputs[places]
        ahead = omega**2 * (position - positions[k])
        ahead += 2.0 * DAMPING * omega * (velocity - sim.state[joints : 2 * joints])
        commands[k] = command + gains @ ahead
        sim.step(commands[k])
    data = np.array(log.data)
    for n, joint in enumerate(model.joints):
        data[:, log.channels.index(f"{joint}.position")] = positions[:, n]
    for n, channel in enumerate(m.drivers):
        if channel in log:
            data[:, log.channels.index(channel)] = commands[:, n]
    return replace(log, data=data)


def _commands_per_effort(model: Model, m: Motion) -> Array:
    """By how much commands have to change for an effort at each joint (nu, n), at the sizes that they have."""
    rest, sizes = np.zeros((3, len(model.joints))), np.max(np.abs(m.inputs), axis=0, initial=0.0)

    def delivered(inputs: Array) -> Array:
        held = np.tile(inputs, (len(rest), 1))
        return np.asarray(model.core.inverse_dynamics(model.theta, rest, rest, rest, held, m.dt, [])[1][-1])

    columns = [(delivered(step) - delivered(-step)) / (2.0 * max(np.sum(step), 1e-300)) for step in np.diag(sizes)]
    return np.asarray(np.linalg.pinv(np.column_stack(columns)))


def _noise(log: Experiment) -> dict[int, float]:
    """Noise of the positions of a log, by the places of their channels."""
    places = [place for place, name in enumerate(log.channels) if name.endswith(".position")]
    return {place: noise_std(log.data[:, place]) for place in places}


def _noisy(made: Experiment, levels: Mapping[int, float], random: np.random.Generator) -> Experiment:
    """With noise of these levels."""
    data = np.array(made.data)
    for place, level in levels.items():
        data[:, place] += level * random.standard_normal(len(data))
    return replace(made, data=data)
