"""Entries that users add to the catalogue: laws of joints, written as expressions."""

import math
import re
from collections.abc import Collection, Mapping
from dataclasses import replace

from vpm.catalogue.formula import Formula, compile_formula
from vpm.catalogue.kinds import ABOVE_ZERO, ANY, NOT_NEGATIVE, EffectParameter, EffectType, shape, size
from vpm.errors import ModelError, UnitError
from vpm.units import parse_unit

_NAME = re.compile(r"[a-z][a-z0-9_]*")
#: Words that mean something else in a law or in a model file.
_TAKEN = frozenset({"q", "v", "pi", "at", "side", "type", "abs", "sqrt", "exp", "tanh", "sin", "cos"})
#: States (SI) and sizes at which a law is tried.
_STATES = ((0.31, -0.77), (-0.52, 0.13), (1.3, 0.9), (0.017, -0.004))
_SIZES = (0.83, 1.9)


def entry_of(
    name: str,
    *,
    law: str,
    sizes: Mapping[str, str],
    sentence: str,
    shapes: Mapping[str, tuple[str, float]] | None = None,
    impossible: str = "",
    not_negative: Collection[str] = (),
    confused_with: Mapping[str, str] | None = None,
) -> EffectType:
    """Catalogue entry of a user's own law; see `vpm.catalogue.register`.

    Raises `ModelError`: a name, a unit, the law or the sentence cannot be used.
    """
    shapes = shapes or {}
    names = (*sizes, *shapes)
    _check_names(name, sizes, names)
    formula = compile_formula(law, names)
    linear = _check_law(name, formula, sizes, [start for _, start in shapes.values()])
    parameters = [
        size(
            short,
            _checked_unit(name, short, unit),
            f"{short} of {name}",
            physical=NOT_NEGATIVE if short in not_negative else ANY,
            linear=linear,
        )
        for short, unit in sizes.items()
    ]
    parameters += [_shape(name, short, unit, start, short in not_negative) for short, (unit, start) in shapes.items()]
    _check_sentence(name, sentence, names)
    return EffectType(
        name=name,
        site="joint",
        group=name,
        parameters=tuple(replace(one, scale="one") for one in parameters),
        law=f"tau = {law}",
        sentence=sentence,
        impossible=impossible or "either sign is possible",
        confused_with=dict(confused_with or {}),
        formula=formula,
    )


def _check_names(name: str, sizes: Mapping[str, str], names: tuple[str, ...]) -> None:
    if not _NAME.fullmatch(name):
        raise ModelError(f'"{name}" is no name of an effect; write it in small letters, digits and _', where=name)
    if not sizes:
        raise ModelError(f"the effect {name} has no size that could be zero; declare one in sizes", where=name)
    for short in names:
        if not _NAME.fullmatch(short) or short in _TAKEN or names.count(short) > 1:
            rest = "choose another in small letters, digits and _"
            raise ModelError(f'the effect {name} cannot have a parameter named "{short}"; {rest}', where=name)


def _checked_unit(name: str, short: str, unit: str) -> str:
    try:
        parse_unit(unit.format(C="m", E="N"))
    except (UnitError, KeyError, IndexError, ValueError) as error:
        rest = "write it with {C} for the unit of the coordinate and {E} for that of the effort"
        raise ModelError(
            f'the unit "{unit}" of {short} in {name} cannot be read ({error}); {rest}', where=name
        ) from None
    return unit


def _shape(name: str, short: str, unit: str, start: float, positive: bool) -> EffectParameter:
    if not math.isfinite(start) or (positive and start <= 0.0):
        rest = "a number above 0" if positive else "a finite number"
        raise ModelError(f"the shape {short} of {name} starts at {start:g}; give {rest}", where=name)
    bounds = ABOVE_ZERO if positive else ANY
    unit = _checked_unit(name, short, unit)
    return shape(short, unit, f"{short} of {name}", start=start, bounds=bounds, learnt=True)


def _check_law(name: str, formula: Formula, sizes: Mapping[str, str], shapes: list[float]) -> bool:
    """Whether a user's own law is linear in its sizes; it has to vanish with them and to be finite."""

    def at(q: float, v: float, numbers: list[float]) -> float:
        try:
            value = formula(q, v, [*numbers, *shapes])
        except (ArithmeticError, ValueError) as error:
            raise ModelError(_at_state(formula, q, v, f"cannot be evaluated ({error})"), where=name) from None
        if not math.isfinite(value):
            raise ModelError(_at_state(formula, q, v, f"gives {value}"), where=name)
        return value

    linear, count = True, len(sizes)
    for q, v in _STATES:
        rest = at(q, v, [0.0] * count)
        if rest != 0.0:
            text = _at_state(formula, q, v, f"gives {rest:g} where all sizes are 0")
            raise ModelError(f"{text}; an effect of no size has to do nothing", where=name)
        parts = [at(q, v, [_SIZES[0] if k == own else 0.0 for k in range(count)]) for own in range(count)]
        expected = sum(parts) * _SIZES[1] / _SIZES[0]
        linear = linear and math.isclose(at(q, v, [_SIZES[1]] * count), expected, rel_tol=1e-9, abs_tol=1e-12)
    return linear


def _at_state(formula: Formula, q: float, v: float, what: str) -> str:
    return f'the law "{formula.text}" {what} at q = {q:g}, v = {v:g}'


def _check_sentence(name: str, sentence: str, names: tuple[str, ...]) -> None:
    try:
        text = sentence.format(at="<at>", **dict.fromkeys(names, "<value>"))
    except (KeyError, IndexError, ValueError) as error:
        known = ", ".join(f"{{{short}}}" for short in ("at", *names))
        raise ModelError(
            f"the sentence of {name} cannot be filled in ({error}); it knows {known}", where=name
        ) from None
    if "<at>" not in text:
        raise ModelError(f"the sentence of {name} does not say where the effect is; put {{at}} into it", where=name)
