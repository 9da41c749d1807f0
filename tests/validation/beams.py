"""Beams at rest and vibrating, against closed forms and converged solutions."""

import numpy as np

import vpm
from reference_arm import P
from validation.machines import arm, cantilever, rectangle, rotor, strip
from validation.observe import at_rest
from validation.row import Array, Row, accepted, against, row, values


def omega(model: vpm.Model, count: int) -> Array:
    """The slowest natural frequencies, rad/s."""
    return 2.0 * np.pi * model.natural_frequencies(np.zeros(len(model.joints)))[:count]


def frequencies() -> list[Row]:
    """Clamped beams: Euler-Bernoulli with and without a mass at the tip, Timoshenko."""
    euler = values("beams")["cantilever_euler_bernoulli"]
    roots = np.square(euler["betaL"])
    source = "roots of the frequency equation"
    rows = []
    for level, count, tolerance in (
        ("strain(12)", 5, 1e-6),
        ("bezier(12)", 4, 1e-6),
        ("deflection(12)", 4, 1e-6),
        ("modal(3)", 3, 1e-6),
        ("hermite(40)", 3, 1e-5),
        ("elements(40)", 3, 1e-5),
        ("lumped(80)", 1, 1e-3),
    ):
        found = omega(cantilever(level, 1.0, strip()), count)
        rows.append(row(f"clamped beam, {level}", found, roots[:count], "rad/s", source, relative=tolerance))
    for mass, betas in euler["betaL_with_tip_mass"].items():
        found = omega(cantilever("strain(10)", 1.0, strip(), tip=float(mass)), len(betas))
        name = f"clamped beam with {mass} of its mass at the tip, strain(10)"
        rows.append(row(name, found, np.square(betas), "rad/s", source, relative=1e-6))
    return [*rows, *timoshenko(), *turning()]


def timoshenko() -> list[Row]:
    """A stout square bar, shear-flexible, with rotary inertia; Cowper's shear factor of the rectangle."""
    case = values("beams")["cantilever_timoshenko"]
    p = case["params"]
    bar = rectangle(p["E"], p["rho"], p["b"], p["h"])
    rows = []
    for level in ("strain(12)", "bezier(12)"):
        model = cantilever(level, p["L"], bar, deforms=("bending_y", "shear_x"))
        found, wanted = omega(model, len(case["omega_rad_s"])), case["omega_rad_s"]
        name = f"stout clamped bar with shear, {level}"
        rows.append(row(name, found, wanted, "rad/s", "Timoshenko, determinant to 30 digits", relative=1e-6))
    return rows


def turning() -> list[Row]:
    """Beams on a turning hub: the pull of the centrifugal force makes them stiffer."""
    rows = []
    for level in ("strain(11)", "bezier(12)", "deflection(12)"):
        found: dict[str, list[Array]] = {"flap": [], "lag": []}
        wanted: dict[str, list[Array]] = {"flap": [], "lag": []}
        for name, case in values("beams")["rotating_cantilever_frequencies"]["values"].items():
            radius, speed = (float(part[len(head) :]) for part, head in zip(name.split("_"), ("r", "eta"), strict=True))
            for plane, deforms in (("flap", "bending_y"), ("lag", "bending_x")):
                found[plane].append(spinning(rotor(radius, deforms, level), speed, len(case[plane])))
                wanted[plane].append(np.array(case[plane]))
        for plane in ("flap", "lag"):
            name = f"turning beam, {plane}, {level}"
            source = "16 Legendre terms, converged"
            rows.append(
                row(name, np.concatenate(found[plane]), np.concatenate(wanted[plane]), "rad/s", source, relative=2e-6)
            )
    return rows


def spinning(model: vpm.Model, speed: float, count: int) -> Array:
    """Frequencies about steady rotation, from the exact linear model."""
    state = np.zeros(model.core.n_states)
    state[len(model.coordinates)] = speed
    matrix, *_ = model.core.linearize(model.theta, state, np.zeros(0))
    poles = np.linalg.eigvals(matrix)
    return np.sort(poles.imag[poles.imag > 1.0])[:count]


def statics() -> list[Row]:
    """Large deflections under a load at the tip and under the own weight; one Bezier curve of low degree."""
    cases, curves = values("beams"), accepted("curves")
    loads = np.array(cases["tip_loaded_cantilever_elastica"]["rows"])
    rows = []
    for level, tolerance in (("strain(9)", 1e-6), ("bezier(10)", 1e-6), ("elements(20)", 1e-6)):
        tips = []
        for load, *_ in loads:
            seen = at_rest(cantilever(level, 1.0, strip(line=1e-12), tip=load, gravity=1.0))
            tips.append((-seen["tip.z"], 1.0 - seen["tip.x"], seen["tip.ry"] - 0.5 * np.pi))
        source = "elastica, elliptic integrals to 30 digits"
        rows.append(row(f"load at the tip, {level}", tips, loads[:, 1:], "m, rad", source, absolute=tolerance))
    weights = np.array(cases["self_weight_cantilever_static"]["rows"])
    sags = [at_rest(cantilever("strain(12)", 1.0, strip(), gravity=weight)) for weight in weights[:, 0]]
    places = [(seen["tip.x"], seen["tip.z"]) for seen in sags]
    source = "14 terms of curvature, converged"
    rows.append(row("own weight, strain(12)", places, weights[:, 1:], "m", source, absolute=1e-7))
    return [*rows, *low_degrees(curves), shear(curves)]


def low_degrees(wanted: dict[str, dict[str, object]]) -> list[Row]:
    """What one Bezier curve of degree 2 or 3 can do and cannot do."""
    force = 1e-6
    seen = at_rest(with_gauge(cantilever("bezier(2)", 1.0, strip(line=1e-12), tip=1.0, gravity=force)))
    return [
        against(wanted["bezier.quadratic.single.omega1"], omega(cantilever("bezier(2)", 1.0, strip()), 1)),
        against(wanted["bezier.cubic.single.omega12"], omega(cantilever("bezier(3)", 1.0, strip()), 2)),
        against(wanted["bezier.quadratic.single.tip_deflection_ratio"], -seen["tip.z"] / (force / 3.0)),
        against(wanted["bezier.quadratic.single.root_curvature_ratio"], seen["root.strain"] / (1e-6 * force)),
    ]


def with_gauge(model: vpm.Model) -> vpm.Model:
    """The cantilever with a gauge 1 micrometre above its axis at the root."""
    return vpm.Model.from_dict(model.to_dict() | {"gauges": {"root": {"beam": "beam", "at": 0.0, "x": -1e-6}}})


def shear(wanted: dict[str, dict[str, object]]) -> Row:
    """The first strip of TUDOR, with shear, under 1 N at the tip."""
    first = rectangle(206e9, 1e-9, 0.004, 0.015)
    first["section"] = {
        "shape": "given",
        "area": 6e-5,
        "moment_x": 0.004 * 0.015**3 / 12.0,
        "moment_y": 0.015 * 0.004**3 / 12.0,
        "torsion": 1e-9,
        "shear_x": 5.0 / 6.0,
        "shear_y": 5.0 / 6.0,
    }
    force = 1e-3
    seen = at_rest(cantilever("bezier(4)", 0.44, first, deforms=("bending_y", "shear_x"), tip=1.0, gravity=force))
    tip = np.array([-seen["tip.z"], seen["tip.ry"] - 0.5 * np.pi])
    return against(wanted["screw.cantilever.tip_force_1N"], tip / force)


def two_links() -> list[Row]:
    """Frequencies and damping of the two-link arm about the horizontal, from the exact linear model."""
    case = values("beams")["two_link_arm_eigenvalues"]
    rows = []
    for level in ("strain(6)", "bezier(7)"):
        model = arm(P, level, gravity=False)
        matrix, *_ = model.core.linearize(model.theta, np.zeros(model.core.n_states), np.zeros(2))
        poles = np.linalg.eigvals(matrix)
        poles = poles[poles.imag > 0.0]
        poles = poles[np.argsort(np.abs(poles))][: len(case["Hz"])]
        found = np.concatenate([np.abs(poles) / (2.0 * np.pi), -poles.real / np.abs(poles)])
        wanted = np.concatenate([case["Hz"], case["damping_ratio"]])
        name = f"two-link arm, frequencies and damping, {level}"
        rows.append(row(name, found, wanted, "Hz, 1", "8 terms of curvature, converged", relative=1e-4))
    return rows


def rows() -> list[Row]:
    """All of them."""
    return [*frequencies(), *statics(), *two_links()]
