"""What drives in sampled time read, and whether their numbers make a model that stays bounded."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vpm.errors import near_match
from vpm.model.messages import Problem, place
from vpm.model.sampled import EXAMPLES, OUTPUT, SAMPLED, MaxwellNarx, Narx
from vpm.model.sampled_terms import Factor, factors_of, poles
from vpm.model.schema import Document
from vpm.model.structure import Structure

#: A pole may be outside of the unit circle by this much: an integrator has one on it, written with rounded numbers.
_ROUNDING = 1e-9


def sampled_problems(document: Document, structure: Structure) -> Iterator[Problem]:
    """Inputs and terms that mean nothing, models that grow without bound, lags and joints that do not fit."""
    for name, actuator in document.actuators.items():
        if not isinstance(actuator, SAMPLED):
            continue
        for position, effect in enumerate(document.effects):
            if effect.traits.late == "lag" and effect.at == name:
                rest = f'is a lag at "{name}", a {actuator.type}, which sees its own samples and no lag between them; '
                yield Problem(place("effects", position), f"{rest}remove it, or identify it with the model")
        if isinstance(actuator, Narx):
            yield from _input_problems(name, actuator, document, structure)
            yield from _model_problems(name, actuator)
        else:
            yield from _element_problems(name, actuator, structure)


def readable(name: str, document: Document, structure: Structure) -> tuple[str, ...]:
    """Channels that a NARX drive may read: its own command, and how joints, transmissions and lines move."""
    turning = (*structure.joints, *document.transmissions)
    joints = (f"{joint}.{kind}" for joint in turning for kind in ("position", "velocity"))
    lines = (f"{line}.{kind}" for line in document.lines for kind in ("length", "rate"))
    return (f"{name}.command", *joints, *lines)


def _input_problems(name: str, actuator: Narx, document: Document, structure: Structure) -> Iterator[Problem]:
    known = readable(name, document, structure)
    for key, channel in actuator.inputs.items():
        where = place("actuators", name, "inputs", key)
        if key == OUTPUT:
            yield Problem(where, "has the name of the output; give the input another one")
        elif channel not in known:
            repair = near_match(channel, known, what="it can read")
            yield Problem(where, f'is "{channel}", which a NARX drive cannot read; {repair}')


def _model_problems(name: str, actuator: Narx) -> Iterator[Problem]:
    if not actuator.terms:
        rest = f"is missing; add it, for example {EXAMPLES['actuators.terms']}, or file with a saved model"
        yield Problem(place("actuators", name, "terms"), rest)
        return
    names, seen = (OUTPUT, *actuator.inputs), dict[tuple[Factor, ...], str]()
    for text in actuator.terms:
        where = place("actuators", name, "terms", text)
        try:
            factors = factors_of(text, names)
        except ValueError as error:
            yield Problem(where, str(error))
            continue
        if factors in seen:
            yield Problem(where, f'is the same term as "{seen[factors]}"; add their coefficients and remove one')
        seen.setdefault(factors, text)
    if len(seen) < len(actuator.terms):
        return
    found = poles(tuple(seen), tuple(actuator.terms.values()))
    if found is not None and np.any(np.abs(found) > 1.0 + _ROUNDING):
        worst = found[np.argmax(np.abs(found))]
        size = f"{worst.real:.4g}" if worst.imag == 0.0 else f"{worst.real:.4g} ± {abs(worst.imag):.4g} j"
        rest = f"give the pole {size}, of magnitude {abs(worst):.4g} above 1, so that the effort grows without bound "
        rest += "from any start; identify the model anew, for example with fewer lags of the output"
        yield Problem(place("actuators", name, "terms"), rest)


def _element_problems(name: str, actuator: MaxwellNarx, structure: Structure) -> Iterator[Problem]:
    for key in ("sample_time", "k0", "s0", "k1", "c1"):
        if getattr(actuator, key) is None:
            rest = f"is missing; add it, for example {EXAMPLES[f'actuators.{key}']}, or file with a saved element"
            yield Problem(place("actuators", name, key), rest)
    if actuator.joint in structure.joints:
        kind = structure.joint_kind(str(actuator.joint))
        if kind != "prismatic":
            rest = f'is a maxwell_narx on the {kind} joint "{actuator.joint}", but it has a length; '
            yield Problem(place("actuators", name), f"{rest}put it on a line, or on a prismatic joint")
