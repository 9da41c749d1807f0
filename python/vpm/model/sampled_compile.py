"""Drives in sampled time for the core."""

from __future__ import annotations

from typing import Any

from vpm.model.sampled import OUTPUT, MaxwellNarx, Narx
from vpm.model.sampled_terms import factors_of
from vpm.model.structure import Structure


def narx_json(name: str, actuator: Narx, structure: Structure) -> dict[str, Any]:
    """Law of a NARX drive; its references are right."""
    terms = actuator.terms or {}
    names = (OUTPUT, *actuator.inputs)
    return {
        "sample_time": actuator.sample_time,
        "inputs": [[key, _reading(name, channel, structure)] for key, channel in actuator.inputs.items()],
        "terms": [[list(factor) for factor in factors_of(text, names)] for text in terms],
        "coefficients": list(terms.values()),
        "limit": actuator.limit,
        "initial": actuator.initial_effort,
    }


def maxwell_json(actuator: MaxwellNarx) -> dict[str, Any]:
    """Law of a Maxwell element in sampled time; all its numbers are there."""

    def filled(coefficients: tuple[float, ...] | None) -> list[float]:
        given = list(coefficients or ())
        return given + [0.0] * (10 - len(given))

    return {
        "sample_time": actuator.sample_time,
        "k0": filled(actuator.k0),
        "s0": filled(actuator.s0),
        "k1": actuator.k1,
        "c1": actuator.c1,
        "scheme": actuator.scheme,
        "limit": actuator.limit,
    }


def _reading(name: str, channel: str, structure: Structure) -> str | dict[str, int]:
    owner, _, kind = channel.rpartition(".")
    if owner == name:
        return "command"
    if owner in structure.joints:
        return {kind: structure.joints.index(owner)}
    of_lines = {"position": "length", "velocity": "rate"}
    return {of_lines.get(kind, kind): structure.wires.index(owner)}
