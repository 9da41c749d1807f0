"""Whether a law that was found does the work of another one if its shape is free."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vpm.discrepancy.screening.candidates import Key
from vpm.numbers import Array
from vpm.ranking.fit import ASTRAY, Fitter, View
from vpm.ranking.look import Look, same_curve
from vpm.ranking.model_structure import Structure
from vpm.ranking.settings import OCTAVE
from vpm.ranking.tried_effect import Trial


def against_free_shapes(trial: Trial, fitter: Fitter) -> Trial:
    """A trial, and which effect of the same curve that was found before gains no less by a free shape.

    Its law is taken beside itself at shapes an octave up and down, each with a size of its own. Laws of friction differ
    so: the excess close to rest is a bell for some and falls off by the square of the speed for others (B.
    Armstrong-Helouvry, P. Dupont and C. Canudas de Wit, *Automatica* 30, 1994). What a bell leaves of the other looks
    like another law, along all of the curve.
    """
    look, noise = trial.look, trial.look.noise
    gained = look.fitted.cost - fitter.cost(trial.fitted.structure, trial.fitted.residual, noise)
    for key in look.fitted.structure.effects:
        if same_curve(key, trial.key) and _gain_of_free_shape(look, key, fitter) >= gained:
            return replace(trial, judgement=replace(trial.judgement, reshaped=" at ".join(key)))
    return trial


def _gain_of_free_shape(look: Look, key: Key, fitter: Fitter) -> float:
    """What a straight step of all that is unknown gains by an effect at neighbouring shapes, too, nats."""
    errors, slopes = look.view.errors(look.coarse, fitter.tracked.parts)
    others = list(_at_other_shapes(look, key, fitter))
    alone, beside = (_after_a_step(look, errors, np.column_stack([slopes, *more])) for more in ([], others))
    return alone - beside


def _after_a_step(look: Look, errors: Array, slopes: Array) -> float:
    """The cost after a step along slopes (n, k) by deviations of priors, the first ones those of what is unknown."""
    z = look.coarse.structure.standard
    start = np.concatenate([z, np.zeros(slopes.shape[1] - len(z))])
    move = -np.linalg.solve(slopes.T @ slopes + np.eye(len(start)), slopes.T @ errors + start)
    return look.noise.cost(errors + slopes @ move) + 0.5 * float((start + move) @ (start + move))


def _at_other_shapes(look: Look, key: Key, fitter: Fitter) -> Iterator[Array]:
    """Change of the errors by deviations of the sizes of an effect (n, k), at shapes an octave up and down."""
    structure, tracker = look.coarse.structure, look.coarse.tracker
    effect = structure.model.effect(*key, structure.side(key))
    own = {name: effect.type.parameter(short) for short, name in effect.parameter_names.items()}
    sizes = [name for name in structure.priors if name in own and not own[name].shape]
    shapes = [name for name, prior in structure.priors.items() if name in own and own[name].shape and prior.logarithmic]
    for name in shapes:
        for factor in (OCTAVE, 1.0 / OCTAVE):
            with contextlib.suppress(*ASTRAY):
                moved = _scaled(structure, name, factor)
                followed = fitter.followed(moved, tracker, sizes)
                felt = replace(moved, priors={size: moved.priors[size] for size in sizes})
                yield View(look.noise).errors(replace(followed, structure=felt), fitter.tracked.parts)[1]


def _scaled(structure: Structure, name: str, factor: float) -> Structure:
    theta = structure.theta.copy()
    theta[structure.place(name)] *= factor
    return replace(structure, theta=theta)
