"""Discriminating experiment for two rival models: the designed motion on which their torque residuals differ most.

Both models follow the same designed motion with the same commands, and their torque residuals are compared. A
difference that other parameters of the second model could imitate does not count. So the second model is fitted to the
first by weighted least squares, with its own covariance as prior. The remainder is the difference. This is the
T-optimality of A. Atkinson and V. Fedorov, "The design of experiments for discriminating between two rival models",
*Biometrika* 62, 1975.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Judged
from vpm.discrepancy.diagnosis import ProposedExperiment
from vpm.discrepancy.rivals.ambiguity import Rivals
from vpm.discrepancy.rivals.designed_motions import Motion, designs
from vpm.discrepancy.rivals.excitation_range import ExcitationRange, excitation_range
from vpm.errors import ExcitationError
from vpm.identify import InverseDynamicsProblem
from vpm.identify.response_along_motion import has_hidden, has_own_drives
from vpm.model import Model
from vpm.numbers import Array

#: A difference below this many times the noise discriminates nothing.
TELLING = 1.0


@dataclass(frozen=True)
class _Residual:
    """Torque residual of a model along a motion of the experiment (n, joints), and its derivative."""

    residual: Array
    slopes: Array


def experiments(
    final: Judged, ambiguous: Sequence[Rivals], data: InverseDynamicsProblem, noise: Mapping[str, float]
) -> tuple[ProposedExperiment, ...]:
    """Discriminating experiment for each pair of an effect and its rival.

    Parameters
    ----------
    final : Judged
        The repaired model.
    ambiguous : sequence of Rivals
    data : InverseDynamicsProblem
        Gives the range within which a motion is proposed: positions, speeds and accelerations that were seen.
    noise : mapping of str to float
        Root mean square noise of each channel of the residual.

    Returns
    -------
    tuple of ProposedExperiment
        None for machines whose drives have states or whose links bend.
    """
    if has_own_drives(final.model) or has_hidden(final.model, data.motions[0].joints):
        return ()
    found = []
    for rivals in ambiguous:
        for trial in rivals.trials:
            if has_hidden(trial.judged.model, data.motions[0].joints):
                continue  # its residual needs a motion that no channel measures
            rival = trial.probe.candidate.label
            joint = _joint_of(final.model, rivals.site, data.joints)
            best = propose(final, trial.judged, (rivals.label, rival), excitation_range(data, joint), noise)
            if best is not None:
                found.append(best)
    return tuple(found)


def propose(
    first: Judged, second: Judged, labels: tuple[str, str], seen: ExcitationRange, noise: Mapping[str, float]
) -> ProposedExperiment | None:
    """Propose the motion that discriminates two models best, or None if no motion is possible."""
    best: ProposedExperiment | None = None
    for motion in _possible(seen):
        difference, joint = _difference(first, second, motion, seen)
        channel = f"{joint}.effort"
        found = ProposedExperiment(
            *labels,
            motion.excitation,
            dict(motion.parameters),
            channel,
            first.model.channel_unit(channel),
            difference,
            float(noise.get(channel, np.nan)),
            "",
        )
        if best is None or found.ratio > best.ratio:
            best = found
    return None if best is None else _with_sentence(best, seen)


def _possible(seen: ExcitationRange) -> Iterator[Motion]:
    for design in designs(seen):
        try:
            yield design()
        except ExcitationError:
            continue  # this one does not fit into the limits


def _difference(first: Judged, second: Judged, motion: Motion, seen: ExcitationRange) -> tuple[float, str]:
    """Root mean square difference of two models in an experiment that the second cannot imitate, and its joint."""
    model = first.model
    inputs = _commands(model, motion, seen)
    one = _residual(model, (), motion, inputs)
    other = _residual(second.model, second.free, motion, inputs)
    change = other.residual - one.residual
    flat, slopes = change.reshape(-1), other.slopes.reshape(change.size, -1)
    spread = max(float(np.sqrt(np.mean(second.fit.residual**2))), 1e-12) * seen.effort
    left = flat - slopes @ _imitation(flat, slopes, second, spread)
    by_joint = np.sqrt(np.mean(left.reshape(change.shape) ** 2, axis=0))
    at = int(np.argmax(by_joint))
    return float(by_joint[at]), model.joints[at]


def _imitation(change: Array, slopes: Array, second: Judged, spread: float) -> Array:
    """Parameter change of the second model that imitates the first in the experiment, with the fit as prior.

    Nothing holds back what the records do not see: its variance is infinite.
    """
    seen = np.isfinite(np.diag(second.fit.covariance))
    among = np.ix_(seen, seen)
    std = np.ones(len(seen))
    std[seen] = np.maximum(np.sqrt(np.clip(np.diag(second.fit.covariance)[seen], 0.0, None)), 1e-12)
    scaled = slopes * std / spread
    inverse = np.zeros((len(seen), len(seen)))
    inverse[among] = np.linalg.pinv((second.fit.covariance / np.outer(std, std))[among], hermitian=True)
    normal = scaled.T @ scaled + inverse
    return np.asarray(std * np.linalg.lstsq(normal, scaled.T @ (change / spread), rcond=1e-12)[0])


def _residual(model: Model, free: Sequence[str], motion: Motion, inputs: Array) -> _Residual:
    columns = [model.index(name) for name in free]
    required, applied, jacobian = model.core.inverse_dynamics(
        model.theta, motion.position, motion.velocity, motion.acceleration, inputs, motion.time_step, columns
    )
    return _Residual(applied - required, -jacobian)


def _commands(model: Model, motion: Motion, seen: ExcitationRange) -> Array:
    """Commands for an experiment: the required effort divided by the mean gain of the drives."""
    count = len(model.inputs)
    rest = np.zeros((len(motion.position), count))
    required = model.core.inverse_dynamics(
        model.theta, motion.position, motion.velocity, motion.acceleration, rest, motion.time_step, []
    )[0]
    for column in range(count):
        full = rest.copy()
        full[:, column] = seen.command
        answer = model.core.inverse_dynamics(
            model.theta, motion.position, motion.velocity, motion.acceleration, full, motion.time_step, []
        )[1]
        joint = int(np.argmax(np.abs(answer[-1])))
        if answer[-1, joint] != 0.0:
            rest[:, column] = required[:, joint] * seen.command / answer[-1, joint]
    return rest


def _joint_of(model: Model, site: str, joints: Sequence[str]) -> str:
    """Joint that the experiment moves for an effect at a site."""
    if site in joints:
        return site
    if site in model.actuators and (driven := [j for j in model.joints_of_actuator(site) if j in joints]):
        return driven[0]
    return next((joint for joint in joints if joint in site), joints[0])


def _with_sentence(found: ProposedExperiment, seen: ExcitationRange) -> ProposedExperiment:
    numbers = ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in found.parameters.items())
    what = f"move {seen.joint} on a {found.excitation.name} ({numbers})"
    size = f"{found.difference:.3g} {found.unit} of {found.channel}, {found.ratio:.3g} times the noise"
    if found.ratio < TELLING:
        text = (
            f"No motion within the range seen tells {found.effect} from {found.rival}: the best, to {what}, "
            f"shows {size}; go beyond that range"
        )
    else:
        text = f"To tell {found.effect} from {found.rival}, {what}: they would differ by {size}"
    return replace(found, sentence=f"{text}.")
