"""Terms of the equations of motion that a model can do without, and what they are worth along a motion.

Products of rates (Coriolis, centrifugal, gyroscopic terms) are those of bodies and flexible links; entries of the mass
matrix couple what is inward of a joint with what is beyond; terms of second order are those in the deflection of a
flexible link. Shares of the dynamics follow D'Imperio (2016), section 2.4.2 and eq 2.109, with the sum of norms as
denominator; see `vpm.linkages.drop_limit` for the same question over a whole workspace.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vpm.errors import SimulationError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.model.beams.level import size_of
from vpm.numbers import Array
from vpm.simulate import Setup, simulate_arrays

if TYPE_CHECKING:
    from vpm.simplify.reductions import Reduction


#: What all of it is called in the place of single parts.
MACHINE = "the machine"
#: Levels that have terms of second order apart from the others: hinges between rigid segments have not.
CURVED = ("modal", "bezier", "deflection", "hermite", "strain", "elements")
#: Coordinates, rates and accelerations, shape (N, n) each.
Motion = tuple[Array, Array, Array]
#: Samples of each record at which the shares are worked out.
SAMPLES = 200
#: Share that is rounding: a single joint about a fixed axis has no Coriolis and centrifugal terms.
ROUNDING = 1e-12
#: Sets of parts that are offered beside the whole machine: the largest, which save most.
SETS = 3


def removable(model: Model) -> Iterator[tuple[str, str]]:
    """Terms that a model has, each with its place: single parts first, then the machine."""
    content = model.to_dict()
    if content.get("velocity_terms", True):
        parts = [name for name, part in _moving(content).items() if part.get("velocity_terms", True)]
        yield from (("velocity", name) for name in parts if len(parts) > 1)
        yield "velocity", MACHINE
    joints = [name for name in coupling_joints(content) if content["joints"][name].get("inertia_coupling", True)]
    yield from (("coupling", name) for name in joints if len(joints) > 1)
    if joints:
        yield "coupling", MACHINE
    for name, beam in content.get("beams", {}).items():
        if beam["level"].startswith(CURVED) and beam.get("second_order", True):
            yield "second-order", name


def without_terms(model: Model, name: str, at: str) -> Model:
    """Model without some of its terms.

    ``name``: one of "velocity", "coupling", "second-order"; ``at``: parts with commas between them, or `MACHINE`.
    """
    content = model.to_dict()
    parts = at.split(", ")
    match name:
        case "velocity" if at == MACHINE:
            content["velocity_terms"] = False
        case "velocity":
            for part in parts:
                content["bodies" if part in content.get("bodies", {}) else "beams"][part]["velocity_terms"] = False
        case "coupling":
            for part in coupling_joints(content) if at == MACHINE else parts:
                content["joints"][part]["inertia_coupling"] = False
        case _:
            content["beams"][at]["second_order"] = False
    return type(model)(content)


def terms_site(name: str, at: str) -> str:
    """Place at which left-out terms of the equations exclude each other: sets of parts do, flexible links do not."""
    return at if name == "second-order" else MACHINE


def coupling_joints(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Joints with coupling terms: they move with coordinates inward of them."""
    carriers = {joint["child"]: (name, joint) for name, joint in content.get("joints", {}).items()}
    beams = content.get("beams", {})

    def moves(part: str) -> bool:
        """Whether a body or beam, or anything that carries it, moves by coordinates, for coupling terms."""
        if part in beams:
            return size_of(beams[part]["level"], beams[part]) > 0 or moves(beams[part]["parent"])
        if part not in carriers:
            return False
        _, joint = carriers[part]
        return joint["type"] != "fixed" or moves(joint["parent"])

    return tuple(name for name, joint in carriers.values() if joint["type"] != "fixed" and moves(joint["parent"]))


def _moving(content: Mapping[str, Any]) -> dict[str, Any]:
    """Bodies that a joint carries, and flexible links that bend: what has Coriolis and centrifugal terms of its own."""
    carried = [joint["child"] for joint in content.get("joints", {}).values() if joint["type"] != "fixed"]
    bodies = {name: content["bodies"][name] for name in carried}
    beams = content.get("beams", {}).items()
    return bodies | {name: beam for name, beam in beams if size_of(beam["level"], beam) > 0}


def motions(model: Model, records: Sequence[Experiment], mode: str, setup: Setup) -> list[Motion]:
    """Motions of a model along records, over which shares of terms are computed.

    ``records``: their commands or references drive the model; ``mode``: one of "free_run", "closed_loop".
    """
    return [_motion(model, record, mode, setup) for record in records]


def effort_share(model: Model, reduced: Model, along: Sequence[Motion]) -> float:
    """Share of joint efforts in left-out terms, the largest of all motions.

    ``X / (I + V + R)`` with root mean squares along the motion of the Euclidean norms over the joints: X what is left
    out, V the Coriolis and centrifugal terms, I inertia times acceleration, R weight, effects and what elastic links
    take. Along a motion the share of single states says little: it is all wherever accelerations change sign.

    ``model``, ``reduced``: of the same coordinates.
    Result: between 0 and 1 for a part of V or I.
    """
    joints, found = len(model.joints), []
    for motion in along:
        missing = (_efforts(model, motion) - _efforts(reduced, motion))[:, :joints]
        left_out = float(np.sqrt(np.mean(np.sum(missing**2, axis=1))))
        whole = float(np.sum(np.sqrt(np.mean(parts(model, *motion) ** 2, axis=0))))
        found.append(left_out / whole if left_out > 0.0 else 0.0)
    return max(found)


def deformation_share(model: Model, beam: str, along: Sequence[Motion]) -> float:
    """Share of the deformation of a link that its terms of second order make, were they loads at rest.

    ``sqrt(d^T K^-1 d / q^T K q)`` with mean squares along the motion: d what the terms are of the forces on the elastic
    coordinates q, K their stiffness. Both are energies, so that neither units nor shape functions matter.
    """
    first_order = without_terms(model, "second-order", beam)
    own = [k for k, name in enumerate(model.coordinates) if name.startswith(f"{beam}.")]
    stiffness, found = _stiffness(model, beam), []
    for motion in along:
        missing = (_efforts(model, motion) - _efforts(first_order, motion))[:, own]
        bent = motion[0][:, own]
        energy = float(np.mean(np.sum((bent @ stiffness) * bent, axis=1)))
        taken = float(np.mean(np.sum(missing * np.linalg.solve(stiffness, missing.T).T, axis=1)))
        found.append(float(np.sqrt(taken / energy)) if energy > 0.0 else 0.0)
    return max(found)


def ranked(
    model: Model, changes: Sequence[Reduction], share: Callable[[Model], float], limit: float
) -> tuple[tuple[Reduction, ...], float]:
    """Sets of parts to do without the same terms: the part that needs them least first, then the next one as well.

    - ``changes``: of single parts, the last of the whole machine
    - ``share``: of a reduced model
    - ``limit``: largest share that is worth a trial
    - result: the sets within the limit, the smallest first, none if the machine has no such terms; the share of the
      machine
    """
    *single, whole = changes
    of_machine = share(whole.applied(model))
    if not of_machine > ROUNDING:
        return (), of_machine
    found = [whole] if of_machine <= limit else []
    # Entries of the mass matrix that are nothing along the motion cost as much as others.
    least = -1.0 if whole.name == "coupling" else ROUNDING
    parts, sets = [], []
    for change in sorted(single, key=lambda each: share(each.applied(model)))[:-1]:
        parts.append(change.at)
        together = replace(whole, at=", ".join(parts))
        if least < share(together.applied(model)) <= limit:
            sets.append(together)
    return (*sets[-SETS:], *found), of_machine


def parts(model: Model, q: Array, v: Array, a: Array) -> Array:
    """Norms of Coriolis and centrifugal terms, inertia terms and the rest at single states, shape (N, 3), N m.

    Joints that move along a line are weighed as if a metre were a radian.

    ``q``, ``v``, ``a``: shape (N, n), coordinates, rates and accelerations.
    """
    joints = len(model.joints)
    rest = _efforts(without_terms(model, "velocity", MACHINE), (q, v, a))[:, :joints]
    velocity = _efforts(model, (q, v, a))[:, :joints] - rest
    inertia = np.array([model.mass_matrix(place) @ change for place, change in zip(q, a, strict=True)])[:, :joints]
    return np.column_stack([np.linalg.norm(part, axis=1) for part in (velocity, inertia, rest - inertia)])


def _efforts(model: Model, motion: Motion) -> Array:
    return np.array([model.inverse_dynamics(*state) for state in zip(*motion, strict=True)])


def _stiffness(model: Model, beam: str) -> Array:
    """Elastic stiffness of a link as a term, from what holds it deformed where clamped and weightless."""
    content: dict[str, Any] = model.to_dict()
    alone = {key: value for key, value in content["beams"][beam].items() if key not in ("at", "second_order")}
    effects = [effect for effect in content.get("effects", []) if effect["at"] == beam]
    clamped = Model(
        {
            "name": beam,
            "gravity": [0.0, 0.0, 0.0],
            "beams": {beam: {**alone, "parent": "world"}},
            "effects": effects,
        }
    )
    still = np.zeros(len(clamped.coordinates))
    return np.array([clamped.inverse_dynamics(shape, still, still) for shape in np.eye(still.size)])


def _motion(model: Model, record: Experiment, mode: str, setup: Setup) -> Motion:
    states = simulate_arrays(model, record, mode, setup=setup).states
    if states is None:
        raise SimulationError(f"{mode} tells no states; choose free_run or closed_loop")
    n = len(model.coordinates)
    q, v = states[:, :n], states[:, n : 2 * n]
    a = np.gradient(v, record.dt, axis=0)
    chosen = np.unique(np.linspace(0, len(q) - 1, min(SAMPLES, len(q))).astype(int))
    return q[chosen], v[chosen], a[chosen]
