"""Effects of a structure judged by one step of a fit without them, much sooner than by a new fit without each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vpm.discrepancy.screening.candidates import Key, acts_on
from vpm.discrepancy.settings import CLEAR_GAIN
from vpm.identify import gain, segments
from vpm.numbers import Array
from vpm.ranking.fit import Fitted, Followed, View
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.noise_model import Parts, fitted_noise
from vpm.ranking.trials import Trials
from vpm.ranking.tried_effect import Trial


def beside_others(trials: Trials, look: Look, keys: Sequence[Key]) -> list[Trial]:
    """Effects of a structure, each beside all others, by one step of a fit without it.

    Efforts are linear in sizes of friction. A fit without one that is needed leads far from the records, and costs many
    times what the fit of all does.

    - ``look``: at the structure with all of them, as it was fitted
    """
    fitted, parts = look.fitted, trials.fitter.tracked.parts
    followed = look.start
    noise = View(fitted_noise(fitted.residual, parts, trials.settings.order))
    step_by, weighed_by = (_precision(followed, view, parts) for view in (View(look.noise), noise))
    found = []
    for key in keys:
        sizes, shapes = _places(fitted.structure, key)
        moves = -fitted.structure.standard[sizes]
        step = _step(step_by, sizes, shapes, moves)
        without = trials.glance(_moved(followed, step, key))
        told = Trial.of(fitted, without, key, ended=False)
        found.append(replace(told, evidence=_evidence(weighed_by, sizes, moves)))
    return found


def shown_in_efforts(trials: Trials, structure: Structure, keys: Sequence[Key]) -> list[Key]:
    """Effects of a structure that do most of the work in the inverse-dynamics residual where they act, by one step.

    A force that nothing explains is in the effort of one joint. What a tracker leaves of its motion is in those of its
    neighbours, too.
    """
    data = trials.data
    own = [name for name in structure.priors if name in structure.model.parameters]
    residual, jacobian = data.evaluate(
        structure.model, structure.theta[: len(structure.model.theta)], [structure.place(name) for name in own]
    )
    places = [list(structure.priors).index(name) for name in own]
    slopes = np.zeros((len(residual), len(structure.priors)))
    slopes[:, places] = jacobian * structure.slopes[places]
    precision = slopes.T @ slopes / float(np.mean(residual**2)) + np.eye(slopes.shape[1])
    found = []
    for key in keys:
        sizes, shapes = _places(structure, key)
        left = residual + slopes @ _step(precision, sizes, shapes, -structure.standard[sizes])
        here = acts_on(structure.model, data, key[1])
        change = gain(here * left, here * residual, segments(data))
        if change.relative >= CLEAR_GAIN and change.score > trials.settings.score:
            found.append(key)
    return found


def _precision(followed: Followed, view: View, parts: Parts) -> Array:
    """Posterior precision of what is unknown in a step without an effect, in deviations of the priors (k, k)."""
    _, slopes = view.weighted(*view.errors(followed, parts))
    return np.asarray(slopes.T @ slopes + np.eye(slopes.shape[1]))


def _places(structure: Structure, key: Key) -> tuple[list[int], list[int]]:
    """Places of sizes and shapes of the effect that a step leaves out, among what is unknown."""
    effect, names = structure.model.effect(*key, structure.side(key)), list(structure.priors)
    own = {name: short for short, name in effect.parameter_names.items()}
    sizes, shapes = (
        [place for place, name in enumerate(names) if name in own and effect.type.parameter(own[name]).shape is shape]
        for shape in (False, True)
    )
    return sizes, shapes


def _step(precision: Array, sizes: list[int], shapes: list[int], moves: Array) -> Array:
    """Most probable step (k,) in which sizes make their moves, and shapes none."""
    rest = np.setdiff1d(np.arange(len(precision)), [*sizes, *shapes])
    step = np.zeros(len(precision))
    step[sizes] = moves
    step[rest] = -np.linalg.solve(precision[rest][:, rest], precision[rest][:, sizes] @ moves)
    return step


def _moved(followed: Followed, step: Array, key: Key) -> Fitted:
    """Structure without one effect after a step, with the residual that derivatives foretell."""
    structure = followed.structure
    left = followed.residual + followed.jacobian @ (step * structure.slopes)
    return Fitted(structure.at(structure.standard + step).without(key), followed.tracker, left, 0.0)


def _evidence(precision: Array, sizes: list[int], moves: Array) -> float:
    """Evidence for sizes that a step takes by some moves to where they do nothing, the centres of their priors, nats.

    Law: the ratio of the prior to the posterior density there (J. Dickey, *The Annals of Mathematical Statistics* 42,
    1971).
    """
    wide = np.linalg.inv(precision)[sizes][:, sizes]
    return 0.5 * float(moves @ np.linalg.solve(wide, moves) + np.linalg.slogdet(wide)[1])
