"""Rigid bodies: mass, centre of mass and inertia, and what is physically possible of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from vpm.model.component import Component, Described, Index
from vpm.model.entry import ZERO, ParameterValue, Switch
from vpm.model.messages import Problem, place
from vpm.model.parameters import ABOVE_ZERO, ANY, NOT_NEGATIVE, Keys, Parameter, Slot

if TYPE_CHECKING:
    from vpm.model.schema import Document
    from vpm.model.structure import Structure

INERTIA_AXES = ("xx", "yy", "zz", "xy", "xz", "yz")
#: An inertia may break its conditions by this share of its size: numbers in files are rounded.
INERTIA_TOLERANCE = 1e-6


class Body(Component):
    """Rigid body: mass, centre of mass in the body frame, inertia about the centre of mass (xx yy zz xy xz yz).

    Without its `velocity_terms` no products of rates load it.
    """

    mass: ParameterValue
    center_of_mass: Annotated[tuple[ParameterValue, ...], Field(min_length=3, max_length=3)] = (ZERO,) * 3
    inertia: Annotated[tuple[ParameterValue, ...], Field(min_length=6, max_length=6)] = (ZERO,) * 6
    velocity_terms: Switch = True

    def slots(self, keys: Keys, structure: Structure) -> Iterator[Slot]:  # noqa: ARG002
        """Parameters of a body."""
        name = keys[1]
        yield Slot((*keys, "mass"), self.mass, "kg", ABOVE_ZERO, kind="linear")
        for i, (axis, quantity) in enumerate(zip("xyz", self.center_of_mass, strict=True)):
            named = f"{name}.center_of_mass.{axis}"
            yield Slot((*keys, "center_of_mass", i), quantity, "m", ANY, named=named)
        for i, (axes, quantity) in enumerate(zip(INERTIA_AXES, self.inertia, strict=True)):
            bounds, named = NOT_NEGATIVE if i < 3 else ANY, f"{name}.inertia.{axes}"
            yield Slot((*keys, "inertia", i), quantity, "kg m^2", bounds, kind="linear", named=named)


def inertia_described(body: str, index: Index) -> Described:
    """Numbers of the parameters from which the core takes the inertia of a body."""
    return {
        "mass": index[f"{body}.mass"],
        "center_of_mass": [index[f"{body}.center_of_mass.{axis}"] for axis in "xyz"],
        "moments": [index[f"{body}.inertia.{axes}"] for axes in INERTIA_AXES],
    }


def inertia_problems(body: str, _: Document, parameters: Mapping[str, Parameter]) -> Iterator[Problem]:
    """Problems of a body's inertia about the centre of mass: negative moment, triangle inequality.

    Principal moments are integrals of squared distances, for example of y^2 + z^2, so none exceeds the sum of the other
    two. (J. Wittenburg, "Dynamics of Multibody Systems", 2008, section 3.1.)
    """
    xx, yy, zz, xy, xz, yz = (parameters[f"{body}.inertia.{axes}"].value for axes in INERTIA_AXES)
    moments = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    slack = INERTIA_TOLERANCE * float(np.abs(moments).max()) + float(np.finfo(np.float64).tiny)
    shown = ", ".join(f"{moment:.4g}" for moment in moments)
    where = place("bodies", body, "inertia")
    if moments[0] < -slack:
        yield Problem(
            where, f"has the principal moments {shown} kg m^2, but none can be negative; correct the products"
        )
    elif moments[0] + moments[1] < moments[2] - slack:
        rest = (
            f"has the principal moments {shown} kg m^2, but the largest cannot exceed the sum of the others"
            f" ({moments[0] + moments[1]:.4g}); correct it"
        )
        yield Problem(where, rest)
