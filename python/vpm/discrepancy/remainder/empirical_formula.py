"""Empirical formula for a residual that no effect explains, and the states that it depends on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from vpm.catalogue import without_law
from vpm.catalogue.empirical import TERMS
from vpm.discrepancy.diagnosis import Empirical, EmpiricalTerm
from vpm.discrepancy.judged_model import Data, Judged, judged_anyhow
from vpm.discrepancy.remainder.sparse_formula import Formula, select
from vpm.discrepancy.remainder.state_dependence import Shares, busiest_joint, own_vibration, rhythm, shares
from vpm.discrepancy.settings import MOST_NAMED, PERIOD_RANGE, WORTH_A_NAME
from vpm.identify import Gain, gain, segments
from vpm.model import Model


@dataclass(frozen=True)
class Described:
    """Description of a remainder: a model, what is said of its residual, and the model with a formula for it."""

    base: Judged
    empirical: Empirical
    judged: Judged
    formula: Formula | None


def describe(base: Judged, data: Data) -> Described:
    """Describe a residual: the states that it depends on, and an empirical formula if one predicts validation data.

    A drift or a rhythm depends on the time of the record and is described in words. As a force of the machine's state
    it would be wrong in the next record.
    """
    joint = busiest_joint(data, base)
    channel = data.validation.efforts(0)[joint].channel
    states, beat = shares(data, base, joint), rhythm(data, base, joint)
    formula = select(base, data)
    fitted = base if formula is None else _fit(formula, base, data)
    gained = gain(base.validation, fitted.validation, segments(data.validation))
    remark, share = _in_time(states.of, beat, gained.relative, own_vibration(data, base, beat[0]))
    if remark or formula is None or gained.relative < WORTH_A_NAME:
        sentence = _say_without(channel, states, remark)
        left = gained.before
        empirical = Empirical(channel, states.of, remark, "", (), left, left, sentence, states.alike, share)
        return Described(base, empirical, base, None)
    return Described(base, _formulated(channel, states, formula, fitted, gained), fitted, formula)


def _formulated(channel: str, states: Shares, formula: Formula, fitted: Judged, gained: Gain) -> Empirical:
    text = "; ".join(_text(formula, fitted.model, at) for at in formula.terms)
    return Empirical(
        channel,
        states.of,
        "",
        text,
        _terms(formula, fitted),
        gained.before,
        gained.after,
        _say(channel, states, text, gained.after / gained.before),
        states.alike,
        gained.relative,
    )


def beside(base: Judged, described: Described, data: Data) -> tuple[Empirical, Judged]:
    """Empirical formula fitted beside accepted effects, the model ``base``, whose parameters stay.

    What is no physics takes nothing from what is.
    """
    told = described.empirical
    if described.formula is None:
        return told, base
    own = tuple(term.dotted for term in told.terms)
    start = described.judged.model.with_parameters({name: base.model.parameters[name].value for name in base.free})
    fitted, _ = judged_anyhow(start, own, data, {})
    better = gain(base.validation, fitted.validation, segments(data.validation))
    states = Shares(told.states, told.alike)
    if better.relative < WORTH_A_NAME:
        sentence = _say_without(told.channel, states, "")
        return replace(told, formula="", terms=(), after=told.before, sentence=sentence, predicted=0.0), base
    fit = replace(
        fitted.fit,
        names=(*base.free, *own),
        values=np.concatenate([base.fit.values, fitted.fit.values]),
        jacobian=np.column_stack([base.fit.jacobian, fitted.fit.jacobian]),
        covariance=block_diag(base.fit.covariance, fitted.fit.covariance),
    )
    judged = replace(fitted, free=fit.names, fit=fit, bounds=base.bounds)
    return _formulated(told.channel, states, described.formula, judged, better), judged


def _fit(formula: Formula, final: Judged, data: Data) -> Judged:
    """Fit of the empirical formula: coefficients, periods of harmonic terms, and free parameters."""
    model = formula.add_to(final.model)
    own = [f"{joint}.empirical.{term}" for joint, terms in formula.terms.items() for term in terms]
    # In a first step the sizes alone: a period has no meaning while they are zero.
    sized, _ = judged_anyhow(model, (*final.free, *own), data, dict(final.bounds))
    periods = [f"{joint}.empirical.period" for joint, shapes in formula.shapes.items() if "period" in shapes]
    if not periods:
        return sized
    bounds = dict(final.bounds)
    for name in periods:
        value = model.parameters[name].value
        bounds[name] = (value / PERIOD_RANGE, value * PERIOD_RANGE)
    return judged_anyhow(sized.model, (*final.free, *own, *periods), data, bounds)[0]


def _terms(formula: Formula, fitted: Judged) -> tuple[EmpiricalTerm, ...]:
    found = []
    for joint, terms in formula.terms.items():
        for term in terms:
            name = f"{joint}.empirical.{term}"
            parameter = fitted.model.parameters[name]
            std = float(fitted.fit.std[fitted.free.index(name)])
            found.append(EmpiricalTerm(joint, TERMS[term], name, parameter.value, std, parameter.unit))
    return tuple(found)


def _text(formula: Formula, model: Model, joint: str) -> str:
    """Text of an empirical formula: ``tau = -(0.31 s + 0.12 s x) N at axis, with x = (q - 0.2 m)/0.5 m``."""
    value = {name: model.parameters[f"{joint}.empirical.{name}"] for name in formula.shapes[joint]}
    terms = formula.terms[joint]

    def written(name: str) -> str:
        return f"{value[name].value:.4g} {value[name].unit}"

    sums = [f"{model.parameters[f'{joint}.empirical.{t}'].value:+.3g} {TERMS[t]}" for t in terms]
    unit = next((model.parameters[f"{joint}.empirical.{t}"].unit for t in terms if not t.startswith("load")), "")
    used = " ".join(TERMS[t] for t in terms)
    meanings = {
        "x": f"x = (q - {written('middle')})/({written('reach')})",
        "y": f"y = v/({written('speed')})",
        "s": f"s = tanh(v/({written('transition_velocity')}))",
        "phi": f"phi = 2 pi q/({written('period')})" if "period" in value else "",
        "|u|": "u the effort of the actuators",
    }
    words = set(used.replace("cos(phi)", "phi").replace("sin(phi)", "phi").replace("^2", "").replace("^3", "").split())
    words |= {"y"} if "y|y|" in words else set()
    with_what = ", ".join(text for word, text in meanings.items() if word in words and text)
    body = " ".join(sums).removeprefix("+")
    return f"tau = -({body}) {unit}".rstrip() + f" at {joint}" + (f", with {with_what}" if with_what else "")


def _in_time(
    states: dict[str, float], beat: tuple[float, float], formula_share: float, own: float
) -> tuple[str, float]:
    """Sentence on a rhythm in time of the residual and its share; empty if formula or state explain it as well.

    - ``own``: frequency of the rhythm, Hz, if links vibrate so by themselves, else 0
    """
    period, repeats = beat
    time = max((share for name, share in states.items() if name.startswith("time")), default=0.0)
    machine = max((formula_share, *(share for name, share in states.items() if not name.startswith("time"))))
    if repeats > max(machine, time) + WORTH_A_NAME:
        if own:
            return (
                f"it rings at {own:.3g} Hz, as links do while joints are held ({100 * repeats:.0f} % of it): their "
                "damping or stiffness may be wrong, or what sets them ringing"
            ), repeats
        return (
            f"it repeats every {period:.3g} s whatever the machine does ({100 * repeats:.0f} % of it), so that "
            "something outside of the machine, or its controller, disturbs it"
        ), repeats
    if time > machine + WORTH_A_NAME:
        return (
            f"it changes with the time in the record ({100 * time:.0f} % of it), not with the state of the machine: "
            "something drifts, as friction does while a machine warms up"
        ), time
    return "", 0.0


def _depends(states: Shares) -> str:
    """States for the empirical description: the best one, those not discriminated from it, and clearly worse ones."""
    named = [name for name, share in states.of.items() if share >= WORTH_A_NAME][:MOST_NAMED]
    if not named or not states.alike:
        return "no single state of the machine predicts it"

    def listed(names: list[str]) -> str:
        return ", ".join(f"{name} ({100 * states.of[name]:.0f} %)" for name in names)

    alike = [name for name in named[1:] if name in states.alike]
    less = [name for name in named[1:] if name not in states.alike]
    sentence = f"it follows {listed(named[:1])}"
    if alike:
        sentence += f", which these data do not discriminate from {listed(alike)}"
    if less:
        sentence += f"{';' if alike else ','} less {listed(less)}"
    return sentence


def _say(channel: str, states: Shares, text: str, ratio: float) -> str:
    return (
        f"Of the residual of {channel}: {_depends(states)}. A fit, which is no physics, brings it down to "
        f"{100 * ratio:.0f} % on validation data and stands in the repaired model as {without_law().name}: {text}."
    )


def _say_without(channel: str, states: Shares, remark: str) -> str:
    if remark:
        return f"Of the residual of {channel}: {remark}; no force law was made of it."
    return f"Of the residual of {channel}: {_depends(states)}, and no short formula predicts it on validation data."
