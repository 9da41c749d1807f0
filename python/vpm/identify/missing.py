"""What a fit leaves beside the motion of its records: signs that an effect is missing, channel by channel."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from vpm.catalogue import effects_for_site
from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.identify.inverse_dynamics import InverseDynamicsProblem
from vpm.identify.problem import FEWEST_SAMPLES, Block, Problem, untied
from vpm.identify.settings import Checks
from vpm.identify.whiteness import (
    REACH,
    SHARPNESS,
    Whiteness,
    default_lags,
    explained_by,
    explained_size,
    heard,
    ljung_box,
    powers,
    shifted,
    waves,
)
from vpm.initial import joint_motion
from vpm.model import Model
from vpm.numbers import Array


class _Law(NamedTuple):
    """Regressors (n, k) of one effect by each of some signals, and whether they are that signal at other times.

    An effect shows in all of them; what one of them has in common with a residual, the others need not have.
    """

    columns: tuple[Array, ...]
    late: bool


#: Laws of a record at the times of a block, for the joints named.
Groups = Callable[[Sequence[str], Block], list[_Law]]


def whiteness(
    model: Model, records: Sequence[Experiment], data: Problem, residual: Array, jacobian: Array, checks: Checks
) -> tuple[Whiteness, ...]:
    """Judge whether effects are missing by what is left of each channel of each record.

    - ``residual``: shape (n,)
    - ``jacobian``: shape (n, p)
    """
    plain = untied(data)
    unseen = _of_unseen(model, plain) if isinstance(plain, InverseDynamicsProblem) else []
    groups = {
        record.name: _of_motion(model, plain, number, checks, unseen)
        if isinstance(plain, InverseDynamicsProblem)
        else _of_log(model, record, checks)
        for number, record in enumerate(records)
    }
    timed = isinstance(plain, InverseDynamicsProblem)
    steps = {record.name: float(record.time[1] - record.time[0]) * timed for record in records}
    judged = (
        _judge(
            model,
            block,
            residual[block.samples],
            jacobian[block.samples],
            groups[block.experiment],
            steps[block.experiment],
            checks,
        )
        for block in data.blocks
    )
    return tuple(one for one in judged if one is not None)


def _judge(
    model: Model, block: Block, residual: Array, slopes: Array, groups: Groups, step: float, checks: Checks
) -> Whiteness | None:
    counts = block.moving > 0.0
    n = int(counts.sum())
    if n < FEWEST_SAMPLES or not np.all(np.isfinite(residual)) or block.scale == 0.0:
        return None
    lags = default_lags(n)
    try:
        added = groups(_joints(model, block.channel), block)
    except VpmError:  # no motion can be had from this log
        added = []
    share, chance = _explained(added, block, residual, slopes, checks)
    late = _late(added, block, residual, slopes, step, checks) if step and chance < checks.level else 0.0
    visible = explained_size(share, residual[counts], block.weight) / block.scale
    white = ljung_box(residual[counts], lags)
    return Whiteness(block.experiment, block.channel, lags, white, share, chance, visible, late)


def _explained(
    laws: Sequence[_Law], block: Block, residual: Array, slopes: Array, checks: Checks
) -> tuple[float, float]:
    """Share of a residual that the best of some laws explains beside what was fitted, and its probability."""
    counts, size = block.moving > 0.0, block.scale * block.weight

    def explained(law: _Law) -> tuple[float, float]:
        columns = law.columns
        if law.late:
            columns = tuple(heard(each, residual, slopes, counts, checks.clear / size) for each in columns)
        return max((explained_by(residual, slopes, each, counts) for each in columns), key=lambda test: test[1])

    tests = [explained(law) for law in laws]
    share, chance = min(tests, key=lambda test: test[1], default=(0.0, 1.0))
    return share, min(1.0, len(tests) * chance)


def _late(laws: Sequence[_Law], block: Block, residual: Array, slopes: Array, step: float, checks: Checks) -> float:
    """Time by which an effort acts later than logged, if less than half a ``step`` explains a residual, else 0."""
    for effort in (law.columns[-1][:, REACH] for law in laws if law.late):
        change = block.weight * step * CubicSpline(block.time, effort)(block.time, 1)
        columns, counts = np.column_stack([slopes, change]), block.moving > 0.0
        (*_, part), *_ = np.linalg.lstsq(columns[counts], residual[counts], rcond=None)
        explains = abs(part) < 0.5 and _explained(laws, block, residual, columns, checks)[1] >= checks.level
        return float(part) * step if explains else 0.0
    return 0.0


def _joints(model: Model, channel: str) -> tuple[str, ...]:
    """Joints at which a channel may miss an effect: its own, those that its drive moves, or all."""
    owner = channel.rpartition(".")[0]
    if owner in model.joints:
        return (owner,)
    if owner in model.actuators:
        return tuple(model.joints_of_actuator(owner)) or tuple(model.joints)
    return tuple(model.joints)


def _of_motion(
    model: Model, problem: InverseDynamicsProblem, record: int, checks: Checks, unseen: Sequence[Array]
) -> Groups:
    """Laws of possibly missing effects by joint motion and efforts, as they are compared.

    What a drive did without being told is in the one, and what its controller heard of noise in the other.
    """
    motion = problem.state(record)
    _, applied, required = problem.effort(model, model.theta, record)
    efforts = [[of[:, k] for of in (required, applied) if np.any(of[:, k])] for k in range(len(problem.joints))]

    def groups(joints: Sequence[str], block: Block) -> list[_Law]:
        places = [problem.joints.index(joint) for joint in joints if joint in problem.joints]
        return [
            law
            for place in places or range(len(problem.joints))
            for law in _laws([part[:, place] for part in motion], efforts[place], checks)
        ] + [_Law((columns[block.samples],), False) for columns in unseen]

    return groups


def _of_unseen(model: Model, problem: InverseDynamicsProblem) -> list[Array]:
    """Contribution (n, sizes) of possibly missing effects at joints that nobody measures."""
    sites = [joint for joint in model.joints if joint not in (*problem.motions[0].joints, *model.added_joints)]
    found = []
    for site, law in product(sites, effects_for_site("joint")):
        if not law.has_law or law.motion or law.memory or law.requires:
            continue
        try:
            more = model.with_effect(law.name, site)
            sizes = [more.index(name) for name in more.adjustable if name not in model.parameters]
            found.append(problem.evaluate(more, more.theta, sizes)[1])
        except (VpmError, ValueError):  # it is there, or asks for what this joint has not
            continue
    return [columns for columns in found if columns.shape[1] and np.all(np.isfinite(columns))]


def _of_log(model: Model, record: Experiment, checks: Checks) -> Groups:
    """Laws of possibly missing effects by motion and commands, at the times of a block."""

    def groups(joints: Sequence[str], block: Block) -> list[_Law]:
        m = joint_motion(record, model)
        places = [m.joints.index(joint) for joint in joints if joint in m.joints] or list(range(len(m.joints)))
        commands = [record[channel] for channel in model.input_channels if channel in record]
        moved = (m.position, m.velocity, m.acceleration)

        def seen(signal: Array) -> Array:
            return np.asarray(np.interp(block.time, record.time, signal))

        return [
            law
            for k in places
            for command in [m.acceleration[:, k], *commands]
            for law in _laws([seen(part[:, k]) for part in moved], [seen(command)], checks)
        ]

    return groups


def _laws(motion: Sequence[Array], efforts: Sequence[Array], checks: Checks) -> list[_Law]:
    """Efforts (n, k) of possibly missing effects: springs, friction, masses, ripple, delays, backlash and others."""
    sharp = [np.tanh(effort / (SHARPNESS * (float(np.sqrt(np.mean(effort**2))) or 1.0))) for effort in efforts]
    late = [tuple(shifted(effort) for effort in each) for each in (efforts, sharp) if each]
    steady = [*(powers(part) for part in motion), *waves(motion[0], checks.waves, checks.waves_each)]
    return [*(_Law((columns,), False) for columns in steady), *(_Law(columns, True) for columns in late)]


def missing_effects(judged: Sequence[Whiteness], checks: Checks) -> list[str]:
    """Sentences on missing effects: channels whose residual repeats with the motion."""
    level = checks.level / max(1, len(judged))
    return [
        f"the residual of {one.channel} in {one.experiment} repeats with the motion, which explains "
        f"{100.0 * one.explained:.0f} % of it (Ljung-Box p = {one.white:.1g} over {one.lags} lags): {_reason(one)}"
        for one in judged
        if one.chance < level and one.visible >= checks.visible
    ]


def _reason(one: Whiteness) -> str:
    if not one.late:
        return "an effect may be missing, run `vpm diagnose`"
    way = "later" if one.late > 0.0 else "earlier"
    lag = f"{-1e3 * one.late:.2g} ms"
    return f"commands act less than half a sample {way} than stamped; give them a delay of {lag} in the channel table"
