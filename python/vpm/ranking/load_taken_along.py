"""Load that a body took along, told from values of the body that its model file all but rules out."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from vpm.catalogue import EFFECTS
from vpm.catalogue.kinds import EffectType
from vpm.discrepancy.screening.candidates import Candidate, extent_of
from vpm.numbers import Array
from vpm.ranking.fit import ASTRAY
from vpm.ranking.model_structure import Structure
from vpm.ranking.structure_extensions import Extensions


def loaded(structure: Structure, file: Structure, extensions: Extensions, names: Sequence[str]) -> Iterator[Structure]:
    """Structures with a load on one body each, in the place of what its values have more than the ``file`` states.

    A load that was taken along is a mass which the file does not have. Mass, centre and inertia of what carries it do
    the same: mass and first moment of the whole are kept, and the body is again as the file states it.

    Law: mass and first moment of bodies that move as one add up (R. Featherstone, *Rigid Body Dynamics Algorithms*,
    Springer 2008, section 2.13).

    Parameters
    ----------
    structure, file : Structure
        As it was fitted, and as the model file states it.
    extensions : Extensions
    names : sequence of str
        Effects that may be added.
    """
    loads = [EFFECTS[name] for name in names if EFFECTS[name].is_load]
    for effect in loads:
        for body in structure.model.bodies:
            own = [name for name in file.priors if name.startswith(f"{body}.") and name in structure.priors]
            more = _more(structure, file, body)
            if own and more is not None:
                with contextlib.suppress(*ASTRAY):
                    yield _with_load(_as_stated(structure, file, own), effect, body, more, extensions)


def _more(structure: Structure, file: Structure, body: str) -> tuple[float, Array] | None:
    """Mass (kg) and place (m) of a load by what a body has more than its file; None if it is no heavier.

    Where the file knows the mass, a first moment tells the load if it is as far out as the masses of the body are.
    """
    (mass, moment), (stated, known) = _moments(structure, body), _moments(file, body)
    load, pull = mass - stated, moment - known
    if load <= 0.0:
        load = float(np.linalg.norm(pull)) / (extent_of(file.model, body)[1] or np.inf)
    return (load, pull / load) if load > 0.0 else None


def _moments(structure: Structure, body: str) -> tuple[float, Array]:
    """Mass (kg) and first moment (kg m) of a body in a structure, without loads."""
    mass, *centre = (
        float(structure.theta[structure.place(f"{body}.{name}")])
        for name in ("mass", *(f"center_of_mass.{axis}" for axis in "xyz"))
    )
    return mass, mass * np.array(centre)


def _as_stated(structure: Structure, file: Structure, names: Sequence[str]) -> Structure:
    """Structure at what the file states of parameters with these names."""
    theta = structure.theta.copy()
    for name in names:
        theta[structure.place(name)] = file.theta[file.place(name)]
    return replace(structure, theta=theta)


def _with_load(
    structure: Structure, effect: EffectType, body: str, more: tuple[float, Array], extensions: Extensions
) -> Structure:
    """Structure with a load of that mass (kg) at that place (m) on a body."""
    mass, place = more
    start = dict(zip(("mass", *"xyz"), (mass, *place.tolist()), strict=True))
    return extensions.extended(structure, Candidate(effect, body, (start,)), start, "motor")
