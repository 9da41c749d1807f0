"""Elements in sampled time from what a drive did: Maxwell and polynomial NARX, as actuators of a model file.

How rich an element is, its degree, is chosen among the records to learn from, each left out in turn. The coefficients
of a NARX model are then found in the loop that its own forces close: one step ahead, and along a given motion, an
element is told where the machine is. In the machine its error moves the joints, whose motion is its input, so that the
least error of a prediction is not that of a simulation.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from scipy.optimize import least_squares

from vpm.errors import VpmError
from vpm.experiment import Experiment
from vpm.identify import OutputErrorProblem
from vpm.model import Model
from vpm.narx import MaxwellNarx, MaxwellSignals, Narx, identify, refine_maxwell
from vpm.numbers import Array
from vpm.simplify.replacement import Replacement, commanded
from vpm.simulate import Setup

#: Force that pulls the ends together (N), length (m), its rate (m/s), drive signal.
Record = Mapping[str, Array]
Entry = dict[str, object]
Element = TypeVar("Element")

#: Total degrees that are tried: of the maps of a Maxwell element, and of a NARX model.
MAXWELL_DEGREES, NARX_DEGREES = (1, 2, 3), (1, 2, 3)
SIGNALS = MaxwellSignals(force="force", length="length", drive="drive")
#: What fast motion meets beside the stiffness at rest, in parts of that, where a fit begins.
FAST = 10.0
#: Most terms of a NARX model: each costs time.
TERMS = 16
#: Integrator of the simulations: the one that is stable whatever the element is like.
STABLE = "linearly_implicit"
#: Relative step of the differences, share of the sum of squares at which the search ends, and its most simulations.
DIFFERENCE, ENOUGH, EVALUATIONS = 1e-6, 1e-3, 100
#: Error where no machine is possible or its simulation fails, in parts of what is compared.
FAILED = 1e2


def maxwell_entry(records: Sequence[Record], step: float) -> Entry | None:
    """Learnt Maxwell NARX element as an actuator; None where no degree gives one.

    ``records``: each of shape (N,); ``step``: between samples, s.
    """
    found = _chosen(records, MAXWELL_DEGREES, lambda some, degree: _maxwell(some, step, degree), _maxwell_gap)
    if found is None:
        return None
    maps = {"k0": found.k0.tolist(), "s0": found.s0.tolist()}
    return {**_sampled("maxwell_narx", step), **maps, "k1": found.k1, "c1": found.c1, "scheme": found.scheme}


def narx_entry(records: Sequence[Record], step: float, channels: Mapping[str, str]) -> Entry | None:
    """Learnt polynomial NARX model as an actuator; None where no degree gives one.

    - ``records``: each of shape (N,)
    - ``step``: between samples, s
    - ``channels``: channel of the model file for ``drive``, ``length`` and ``rate``
    """
    found = _chosen([_pushing(each) for each in records], NARX_DEGREES, _narx, _narx_gap)
    if found is None:
        return None
    terms = dict(zip(found.term_names, map(float, found.coefficients), strict=True))
    used = {name: channels[name] for name in found.inputs if any(f"{name}[" in term for term in terms)}
    first = float(records[0]["force"][0])
    return {**_sampled("narx", step), "inputs": used, "terms": terms, "limit": found.limit, "initial_effort": -first}


def _sampled(kind: str, step: float) -> Entry:
    return {"type": kind, "sample_time": step, "command_unit": "1"}


def _chosen(
    records: Sequence[Record],
    degrees: Sequence[int],
    fit: Callable[[Sequence[Record], int], Element | None],
    gap: Callable[[Element, Record], float],
) -> Element | None:
    """Learnt model of the degree that predicts records left out best, fitted to all of them."""
    parts = records if len(records) > 1 else _halves(records[0])
    errors: dict[int, float] = {}
    for degree in degrees:
        total = 0.0
        for place, test in enumerate(parts):
            model = fit([*parts[:place], *parts[place + 1 :]], degree)
            total += float("inf") if model is None else gap(model, test)
        errors[degree] = total
    for degree in sorted(degrees, key=lambda each: errors[each]):
        whole = fit(records, degree)
        if whole is not None and np.isfinite(errors[degree]):
            return whole
    return None


def _halves(record: Record) -> list[Record]:
    half = len(record["force"]) // 2
    return [{name: values[part] for name, values in record.items()} for part in (slice(half), slice(half, None))]


def _maxwell(records: Sequence[Record], step: float, degree: int) -> MaxwellNarx | None:
    """Learnt Maxwell element, fitted in free runs; none that no file could hold."""
    joined = {name: np.concatenate([record[name] for record in records]) for name in records[0]}
    force, length, rate = joined["force"], joined["length"], joined["rate"]
    fixed = np.column_stack([np.ones_like(force), joined["drive"], rate])
    stiffness = np.linalg.lstsq(np.column_stack([fixed, length]), force, rcond=None)[0][-1]
    if not stiffness > 0.0:
        # Length and drive signal went together, so that the records do not tell their parts.
        stiffness = float(np.std(force) / np.std(length))
    constant, drive, damping = np.linalg.lstsq(fixed, force - stiffness * length, rcond=None)[0]
    free = np.array([-constant / stiffness, -drive / stiffness])
    c1 = float(damping) if damping > 0.0 else stiffness * step
    try:
        start = MaxwellNarx(np.array([stiffness]), free, FAST * stiffness, c1, step)
        element = refine_maxwell(start, [dict(each) for each in records], SIGNALS, degree=degree).element
    except VpmError:
        return None
    return element if element.k1 > 0.0 and element.c1 > 0.0 else None


def _maxwell_gap(element: MaxwellNarx, record: Record) -> float:
    """Root mean square force error of a learnt Maxwell element in a free run."""
    force = record["force"]
    try:
        found = element.simulate_free_run(record["length"], (force[0], force[1]), record["drive"])
    except VpmError:
        return float("inf")
    return float(np.sqrt(np.mean(np.square(found - force))))


def _pushing(record: Record) -> Record:
    return {"effort": -record["force"], **{name: record[name] for name in ("drive", "length", "rate", "force")}}


def _narx(records: Sequence[Record], degree: int) -> Narx | None:
    lags = {name: [0, 1] for name in ("drive", "length", "rate")}
    try:
        return identify(
            [dict(each) for each in records],
            output="effort",
            inputs=tuple(lags),
            output_lags=1,
            input_lags=lags,
            degree=degree,
            max_terms=TERMS,
        )
    except VpmError:
        return None


def _narx_gap(model: Narx, record: Record) -> float:
    try:
        run = model.simulate_free_run(dict(record))
    except VpmError:
        return float("inf")
    return float(np.sqrt(np.mean(np.square(run.values - run.measured))))


def trained(
    model: Model, element: Replacement, records: Sequence[Experiment], mode: str, channels: Sequence[str] | None
) -> Replacement:
    """Learnt element with coefficients with which the machine moves most like the full one.

    - ``element``: a NARX model, where the search begins; it stays what it is where the machine cannot be simulated with
      it
    - ``mode``: one of "free_run", "closed_loop"
    - ``channels``: what is compared; by default all that the records hold
    """
    entry: dict[str, Any] = json.loads(element.entry)
    names, start = list(entry["terms"]), np.array(list(entry["terms"].values()))
    sizes = np.abs(start)

    def with_shares(shares: Array) -> Replacement:
        terms = dict(zip(names, (float(value) for value in shares * sizes), strict=True))
        return replace(element, entry=json.dumps({**entry, "terms": terms}))

    try:
        first = element.applied(model)
        driven = [commanded(first, model, record) for record in records]
        own_mode = mode if first.controlled_actuators else "free_run"
        problem = OutputErrorProblem(first, driven, own_mode, channels=channels, setup=Setup(STABLE))
        least, _ = problem.evaluate(first, first.theta)
    except VpmError:
        return element

    def residual(shares: Array) -> Array:
        try:
            machine = with_shares(shares).applied(model)
            return problem.evaluate(machine, machine.theta)[0]
        except VpmError:
            return np.full_like(least, FAILED)

    # The lags of one signal are nearly alike: damped steps, scaled by the columns, go along what tells them apart.
    found = least_squares(
        residual,
        np.sign(start),
        method="lm",
        x_scale="jac",
        diff_step=np.array(DIFFERENCE),
        ftol=ENOUGH,
        max_nfev=EVALUATIONS,
    )
    return with_shares(found.x) if 2.0 * found.cost < float(least @ least) else element
