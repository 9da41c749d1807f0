"""Timing of commands: what a shift of all of them within one sample explains is no missing physics."""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.discrepancy.settings import CLEAR_GAIN
from vpm.model import Model
from vpm.numbers import Array
from vpm.ranking.fit import ASTRAY, Fitter, free_step
from vpm.ranking.look import Look
from vpm.ranking.tried_effect import Trial

#: Steps in which the best shift is found: errors are a parabola over it, and the first step takes them as straight.
STEPS = 4


def against_timing(trial: Trial, fitter: Fitter) -> Trial:
    """Trial of an effect judged beside a shift of all commands.

    A command may hold from its sample on, until its sample, or as the mean over the interval; the log does not tell.
    Beside the best shift within one sample an effect has to gain what any effect has to, but for a delay or lag of an
    only drive or instrument that is most of what was missing.
    """
    look, noise = trial.look, trial.look.noise
    alone = not has_peers(look.fitted.structure.model, trial.key[1])
    if EFFECTS[trial.key[0]].late and alone and trial.judgement.removed >= CLEAR_GAIN:
        return trial
    gained = look.fitted.cost - fitter.cost(trial.fitted.structure, trial.fitted.residual, noise)
    with contextlib.suppress(*ASTRAY):
        gain, samples = _shifted(look, fitter)
        if gained - gain < look.needed:
            by, way = 1e3 * abs(samples) * fitter.tracked.records[0].dt, "later" if samples > 0.0 else "earlier"
            words = f"all commands {by:.2g} ms {way}, within their sampling interval"
            return replace(trial, judgement=replace(trial.judgement, timed=words))
    return trial


def _shifted(look: Look, fitter: Fitter) -> tuple[float, float]:
    """Gain of the best shift of all commands within one sample, nats, and by how many samples they come later.

    All that is unknown takes a step beside it.
    """
    tracked, parts = fitter.tracked, fitter.tracked.parts
    errors, slopes = look.view.errors(look.coarse, parts)

    def shifted_by(samples: int) -> Array:
        other = Fitter(tracked.with_commands_later(samples), fitter.settings)
        moved = other.followed(look.coarse.structure, look.coarse.tracker, ()).residual
        return look.noise.whitened(moved, parts)

    later, earlier = shifted_by(1), shifted_by(-1)
    straight, bent, z = (later - earlier) / 2.0, (later + earlier) / 2.0 - errors, look.coarse.structure.standard
    samples = 0.0
    for _ in range(STEPS):
        now, along = errors + samples * straight + samples**2 * bent, straight + 2.0 * samples * bent
        move = float(free_step(now, np.column_stack([slopes, along]), z)[-1])
        samples = float(np.clip(samples + move, -1.0, 1.0))
    now = errors + samples * straight + samples**2 * bent
    return _cost(look, errors, slopes, z) - _cost(look, now, slopes, z), samples


def _cost(look: Look, errors: Array, slopes: Array, z: Array) -> float:
    """Cost after a step of all that is unknown beside a shift of commands."""
    move = free_step(errors, slopes, z)
    return look.noise.cost(errors + slopes @ move) + 0.5 * float((z + move) @ (z + move))


def has_peers(model: Model, site: str) -> bool:
    """Whether several drives, or several position sensors, share one clock, so that a delay of one is no refusal."""
    encoders = {model.sensor_of(f"{joint}.position") for joint in model.joints} - {None}
    return any(site in group and len(group) > 1 for group in (set(model.actuators), encoders))
