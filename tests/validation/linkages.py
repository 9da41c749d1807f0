"""KARL and the HyQ leg, read from the example files, against published and recomputed values."""

import numpy as np
from numpy.typing import ArrayLike

from places import EXAMPLES
from validation.row import Array, Row, accepted, against
from vpm import linkages
from vpm.linkages import Karl, Leg

Found = dict[str, ArrayLike]


def distinct(rows: Array) -> int:
    """Number of rows that differ."""
    return len(np.unique(np.round(rows, 6), axis=0))


def karl() -> list[Row]:
    """Singular strokes, assembly modes, transmission."""
    machine = linkages.load(EXAMPLES / "karl" / "karl.toml")
    if not isinstance(machine, Karl):
        raise TypeError("karl.toml describes another linkage")
    singular, poses = machine.singularities(), machine.direct((0.20, 0.18))
    target = machine.end_point(np.radians([20.0, 90.0]))
    ways = machine.inverse(target)
    found: Found = {
        "karl.alpha_deg": np.degrees(machine.geometry.stroke_direction),
        "karl.L1": machine.geometry.medial,
        "karl.count.direct": distinct(np.hstack([poses.angles, poses.strokes])),
        "karl.count.inverse": distinct(np.hstack([ways.angles, ways.strokes])),
        "karl.sylvester_degree": np.flatnonzero(np.abs(machine.resultant(0, 0.2)) > 1e-15).max(),
        "karl.inverse.target": target,
        "karl.inverse.solutions": np.hstack([np.degrees(ways.angles), ways.strokes]),
        "karl.q1_span_between_singularities_deg": np.degrees(machine.span(0)),
    }
    arrangements = [
        ("karl.singular_delta1.outer", 0, "extended"),
        ("karl.singular_delta1.inner", 0, "folded"),
        ("karl.singular_delta2.extended", 1, "extended"),
        ("karl.singular_delta2.folded", 1, "folded"),
    ]
    for name, actuator, arrangement in arrangements:
        strokes = singular.of(actuator, arrangement=arrangement)
        found |= {name: strokes, f"{name}.published": strokes}
    for millimetres in ((200, 180), (210, 160), (190, 220)):
        name = f"d1_{millimetres[0]}_d2_{millimetres[1]}"
        poses = machine.direct(np.array(millimetres) / 1000.0)
        for joint in (0, 1):
            degrees = np.degrees(poses.angles[:, joint])
            found[f"karl.direct.{name}.q{joint + 1}_deg"] = np.unique(degrees.round(9))
        built = (np.abs(poses.angles[:, 0]) < np.pi / 2) & (poses.angles[:, 1] > 0.0)
        found[f"karl.lambda.{name}"] = poses.transmission[built]
    return complete("karl", found)


def leg() -> list[Row]:
    """Strokes, levers, the terms of the dynamics by three derivations, their shares over the workspace."""
    machine = linkages.load(EXAMPLES / "hyq_leg" / "leg.toml")
    if not isinstance(machine, Leg):
        raise TypeError("leg.toml describes another linkage")
    found: Found = {}
    for name, degrees in {"q-40_-140": (-40, -140), "q20_-80": (20, -80), "q60_-20": (60, -20)}.items():
        found[f"hyq.stroke.{name}"] = machine.strokes(np.radians(degrees))
        found[f"hyq.lever.{name}"] = machine.levers(np.radians(degrees))
    hip, knee = machine.stroke_table().range
    found |= {"hyq.stroke_range.hip": hip, "hyq.stroke_range.knee": knee}
    q, v, a = np.radians([20.0, -80.0]), [2.0, -3.0], [4.0, -5.0]
    terms, torques = machine.terms(q, v), machine.torques(q, v, a)
    found |= {"hyq.M": terms.mass_matrix, "hyq.V": terms.velocity, "hyq.G": terms.gravity, "hyq.tau": torques}
    found["hyq.cylinder_force"] = machine.cylinder_forces(q, torques)
    found["hyq.ground_reaction"] = machine.reactions(q, v, a).ground
    found["hyq.three_way_agreement"] = disagreement(machine)
    for shank in (0.341, 0.375):
        for short, duty in {"LD": "low", "MD": "medium", "HD": "high"}.items():
            shares = 100.0 * Leg.hyq("table", shank=shank).shares(duty).mean
            found[f"hyq.index.LLL{1000 * shank:.0f}.{short}"] = shares
            found[f"hyq.index.published.{short}"] = shares
    return complete("hyq", found)


def disagreement(machine: Leg) -> float:
    """Largest difference of three derivations in 400 states, relative to the torque."""
    random = np.random.default_rng(1)
    q = np.radians(random.uniform((-40.0, -140.0), (60.0, -20.0), (400, 2)))
    v, a = random.uniform(-10.0, 10.0, (400, 2)), random.uniform(-5.0, 5.0, (400, 2))
    work = machine.torques(q, v, a)
    others = [machine.torques(q, v, a, "lagrange"), machine.torques(q, v, a, "newton_euler")]
    scale = np.abs(work).max(axis=1, keepdims=True)
    return float(max(np.abs((work - other) / scale).max() for other in others))


def complete(file: str, found: Found) -> list[Row]:
    """Rows of all values of a file: none may be missing, and nothing else may be there."""
    wanted = accepted(file)
    if set(wanted) != set(found):
        raise ValueError(f"{file}: these names are on one side only: {sorted(set(wanted) ^ set(found))}")
    return [against(entry, found[name]) for name, entry in wanted.items()]
