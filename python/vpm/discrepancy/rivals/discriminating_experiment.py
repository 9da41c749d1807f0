"""Discriminating experiment for two rival models: the designed motion on which their torque residuals differ most.

Both models follow the same designed motion with the same commands, and their torque residuals are compared. A
difference that other parameters of the second model could imitate does not count. So the second model is fitted to the
first by weighted least squares, with its own covariance as prior. The remainder is the difference. This is the
T-optimality of A. Atkinson and V. Fedorov, "The design of experiments for discriminating between two rival models",
*Biometrika* 62, 1975.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from vpm.discrepancy.diagnosis import ProposedExperiment
from vpm.discrepancy.judged_model import Judged
from vpm.discrepancy.rivals.ambiguity import Rivals
from vpm.discrepancy.screening.candidates import joint_at
from vpm.discrepancy.settings import AMPLITUDES, DURATION, EXPERIMENT_SAMPLES, LONGEST_EXPERIMENT, RANGE_SHARE, SPEEDS
from vpm.errors import ExcitationError
from vpm.excitation import Excitation, JointLimits, chirp, multisine, trapezoid
from vpm.identify import InverseDynamicsProblem
from vpm.identify.response_along_motion import has_hidden, has_own_drives
from vpm.model import Model
from vpm.numbers import Array


def experiments(
    final: Judged, ambiguous: Sequence[Rivals], data: InverseDynamicsProblem, noise: Mapping[str, float]
) -> tuple[ProposedExperiment, ...]:
    """Discriminating experiment for each pair of an effect and its rival.

    - ``final``: the repaired model
    - ``data``: gives the range within which a motion is proposed: positions, speeds and accelerations that were seen
    - ``noise``: root mean square noise of each channel of the residual

    None for machines whose drives have states or whose links bend.
    """
    if has_own_drives(final.model) or has_hidden(final.model, data.motions[0].joints):
        return ()
    found = []
    for rivals in ambiguous:
        for trial in rivals.trials:
            other = trial.judged.model
            if has_own_drives(other) or has_hidden(other, data.motions[0].joints):
                continue  # its residual needs states of a drive, or a motion that no channel measures
            here = joint_at(final.model, rivals.site)
            joint = here if here in data.joints else data.joints[0]
            best = propose(final, trial.judged, (rivals.label, trial.label), excitation_range(data, joint), noise)
            if best is not None:
                found.append(best)
    return tuple(found)


def propose(
    first: Judged, second: Judged, labels: tuple[str, str], seen: ExcitationRange, noise: Mapping[str, float]
) -> ProposedExperiment | None:
    """Propose the motion that discriminates two models best, or None if no motion is possible."""
    best: ProposedExperiment | None = None
    for design in designs(seen):
        try:
            motion = design()
        except ExcitationError:
            continue  # this one does not fit into the limits
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


def _difference(first: Judged, second: Judged, motion: Motion, seen: ExcitationRange) -> tuple[float, str]:
    """Root mean square difference of two models in an experiment that the second cannot imitate, and its joint."""
    model = first.model
    inputs = _commands(model, motion, seen)
    one, _ = _residual(model, (), motion, inputs)
    other, slopes = _residual(second.model, second.free, motion, inputs)
    change = other - one
    flat, slopes = change.reshape(-1), slopes.reshape(change.size, -1)
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


def _residual(model: Model, free: Sequence[str], motion: Motion, inputs: Array) -> tuple[Array, Array]:
    """Torque residual of a model along a motion of the experiment (n, joints), and its derivative."""
    required, applied, jacobian = _efforts(model, motion, inputs, [model.index(name) for name in free])
    return applied - required, -jacobian


def _efforts(model: Model, motion: Motion, inputs: Array, columns: Sequence[int] = ()) -> tuple[Array, Array, Array]:
    states, step = (motion.position, motion.velocity, motion.acceleration), motion.excitation.time_step
    return model.core.inverse_dynamics(model.theta, *states, inputs, step, list(columns))


def _commands(model: Model, motion: Motion, seen: ExcitationRange) -> Array:
    """Commands for an experiment: the required effort divided by the mean gain of the drives."""
    count = len(model.inputs)
    rest = np.zeros((len(motion.position), count))
    required = _efforts(model, motion, rest)[0]
    for column in range(count):
        full = rest.copy()
        full[:, column] = seen.command
        answer = _efforts(model, motion, full)[1]
        joint = int(np.argmax(np.abs(answer[-1])))
        if answer[-1, joint] != 0.0:
            rest[:, column] = required[:, joint] * seen.command / answer[-1, joint]
    return rest


def _with_sentence(found: ProposedExperiment, seen: ExcitationRange) -> ProposedExperiment:
    numbers = ", ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in found.parameters.items())
    what = f"move {seen.joint} on a {found.excitation.name} ({numbers})"
    size = f"{found.difference:.3g} {found.unit} of {found.channel}, {found.ratio:.3g} times the noise"
    if found.ratio < 1.0:
        text = (
            f"No motion within the range seen tells {found.effect} from {found.rival}: the best, to {what}, "
            f"shows {size}; go beyond that range"
        )
    else:
        text = f"To tell {found.effect} from {found.rival}, {what}: they would differ by {size}"
    return replace(found, sentence=f"{text}.")


@dataclass(frozen=True)
class Motion:
    """Designed motion: an excitation, and the motion of all joints (n, joints) that it means."""

    excitation: Excitation
    parameters: Mapping[str, float | str]
    position: Array
    velocity: Array
    acceleration: Array


def designs(seen: ExcitationRange) -> list[Callable[[], Motion]]:
    """Designed motions to choose from; each raises `ExcitationError` if it does not fit into the limits."""
    ways = [partial(_way, seen, share) for share in SPEEDS]
    waves = [partial(design, seen, share) for share in AMPLITUDES for design in (_chirp, _multisine)]
    return [*ways, *waves]


def _way(seen: ExcitationRange, share: float) -> Motion:
    """Designed motion back and forth at constant speed with rests; a slow one uses the time available."""
    speed = share * seen.speed
    middle, half = 0.5 * (seen.low + seen.high), 0.5 * RANGE_SHARE * (seen.high - seen.low)
    half = min(half, 0.05 * LONGEST_EXPERIMENT * speed)
    limits = {seen.joint: JointLimits((seen.low, seen.high), speed, seen.acceleration)}
    points = {seen.joint: [middle - half, middle + half, middle - half, middle, middle + half, middle - half]}
    step = _step(seen, LONGEST_EXPERIMENT)
    made = trapezoid(points, limits, time_step=step, dwell=0.5, unit=seen.unit)
    numbers = {"speed": speed, "amplitude": half, "offset": middle, "acceleration": seen.acceleration, "dwell": 0.5}
    motion = (made[f"{seen.joint}.{quantity}"] for quantity in ("position", "velocity", "acceleration"))
    return _motion(seen, made, numbers, *motion)


def _chirp(seen: ExcitationRange, share: float) -> Motion:
    middle, amplitude = 0.5 * (seen.low + seen.high), 0.5 * RANGE_SHARE * share * (seen.high - seen.low)
    fastest = _fastest(seen, amplitude)
    first = max(0.1 * fastest, 2.0 / DURATION)
    made = chirp(
        f"{seen.joint}.position",
        seen.unit,
        first=min(first, fastest),
        last=fastest,
        amplitude=amplitude,
        duration=DURATION,
        time_step=_step(seen, DURATION),
        mean=middle,
    )
    numbers = {"amplitude": amplitude, "offset": middle, "first": min(first, fastest), "last": fastest}
    return _from_position(seen, made, {**numbers, "duration": DURATION})


def _multisine(seen: ExcitationRange, share: float) -> Motion:
    middle, amplitude = 0.5 * (seen.low + seen.high), 0.5 * RANGE_SHARE * share * (seen.high - seen.low)
    fastest = max(_fastest(seen, amplitude), 3.0 / DURATION)
    made = multisine(
        f"{seen.joint}.position",
        seen.unit,
        band=(1.0 / DURATION, fastest),
        period=DURATION,
        time_step=_step(seen, DURATION),
        peak=amplitude,
        phases="schroeder",
    )
    shifted = Excitation(made.name, made.time, made.data + middle, made.channels, made.units, made.notes)
    return _from_position(
        seen, shifted, {"peak": amplitude, "offset": middle, "first": 1.0 / DURATION, "last": fastest}
    )


def _fastest(seen: ExcitationRange, amplitude: float) -> float:
    """Highest frequency in Hz of a designed sine within the speed and acceleration of the records."""
    return min(seen.speed / amplitude, float(np.sqrt(seen.acceleration / amplitude))) / (2.0 * np.pi)


def _step(seen: ExcitationRange, duration: float) -> float:
    """Time step of a designed motion: a multiple of that of the records, and a whole part of a second."""
    step = max(seen.time_step, duration / EXPERIMENT_SAMPLES)
    return 1.0 / max(1, int(1.0 / step))


def _from_position(seen: ExcitationRange, made: Excitation, numbers: Mapping[str, float | str]) -> Motion:
    position = made[f"{seen.joint}.position"]
    velocity = np.gradient(position, made.time_step)
    return _motion(seen, made, numbers, position, velocity, np.gradient(velocity, made.time_step))


def _motion(
    seen: ExcitationRange,
    made: Excitation,
    numbers: Mapping[str, float | str],
    position: Array,
    velocity: Array,
    acceleration: Array,
) -> Motion:
    """Designed motion of all joints; those that are not excited stand still."""
    joints = list(seen.hold)
    place = joints.index(seen.joint)
    table = np.tile([seen.hold[name] for name in joints], (position.size, 1))
    rates, pushes = np.zeros_like(table), np.zeros_like(table)
    table[:, place], rates[:, place], pushes[:, place] = position, velocity, acceleration
    return Motion(made, numbers, table, rates, pushes)


@dataclass(frozen=True)
class ExcitationRange:
    """Excitation range of one joint: way, speed and acceleration; other joints stay at ``hold``."""

    joint: str
    unit: str  #: rad or m.
    low: float
    high: float
    #: 99.9 % quantiles of the absolute values.
    speed: float
    acceleration: float
    time_step: float  #: s.
    hold: dict[str, float]  #: Mean position of every joint.
    command: float  #: Largest command of any actuator.
    effort: float  #: What the weighted residual has to be multiplied by to be an effort of this joint.


def excitation_range(data: InverseDynamicsProblem, joint: str) -> ExcitationRange:
    """Excitation range of ``joint`` in the records."""
    motions = data.motions
    column = motions[0].joints.index(joint)
    position, velocity, acceleration = (
        np.concatenate([getattr(m, quantity)[m.kept][:, column] for m in motions])
        for quantity in ("position", "velocity", "acceleration")
    )
    commands = [float(np.abs(m.inputs).max()) for m in motions if m.inputs.size]
    block = data.efforts(0)[data.joints.index(joint)]
    return ExcitationRange(
        joint,
        "m" if block.unit == "N" else "rad",
        float(position.min()),
        float(position.max()),
        max(float(np.quantile(np.abs(velocity), 0.999)), 1e-12),
        max(float(np.quantile(np.abs(acceleration), 0.999)), 1e-12),
        max(m.dt for m in motions),
        {name: float(np.mean(motions[0].position[:, k])) for k, name in enumerate(motions[0].joints)},
        max([*commands, 1e-12]),
        1.0 / block.weight,
    )
