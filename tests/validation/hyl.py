"""The HyL leg from its model files: against recomputed values, and against a solution that was made without vpm."""

import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import vpm
from places import EXAMPLES
from validation.row import Array, Row, accepted, against, row, values

HYL = EXAMPLES / "hyl"
#: Height of the hip axis with the foot on the ground in the desired pose (m).
STANDING = (0.350 + 0.341) * np.cos(np.radians(40.0))
SMOOTH = {"foot.friction.static": 0.0, "foot.friction.dynamic": 0.0}

#: Model file and parameters of each case of the witness.
CASES: Mapping[str, tuple[str, dict[str, float]]] = {
    "rigid, low gain": ("rcm.toml", {}),
    "rigid, high gain": ("rcm.toml", {"hip_impedance.proportional": 300.0, "knee_impedance.proportional": 300.0}),
    "bushings, low gain": ("fcm.toml", {}),
    "springs": ("rcm_springs.toml", {}),
    "springs, bushings": ("fcm_springs.toml", {}),
    "hydraulic, low gain": ("hydraulic.toml", {}),
    "hydraulic, high gain": (
        "hydraulic.toml",
        {"hip_impedance.proportional": 300.0, "knee_impedance.proportional": 300.0},
    ),
    "hydraulic, bushings": ("hydraulic_fcm.toml", {}),
}
#: Channels of the package by those of the witness.
CHANNELS = {
    "height": "slider.position",
    "hip_force": "hip_drive.force",
    "knee_force": "knee_drive.force",
    "normal_force": "foot.normal_force",
    "hip_pressure_a": "hip_drive.pressure_a",
    "hip_pressure_b": "hip_drive.pressure_b",
    "knee_pressure_a": "knee_drive.pressure_a",
    "knee_pressure_b": "knee_drive.pressure_b",
}


def gain(proportional: float) -> dict[str, float]:
    """Parameters of both joint controllers."""
    return {f"{joint}_impedance.proportional": proportional for joint in ("hip", "knee")}


def scenario(file: str, runs: list[dict[str, Any]], **changes: object) -> vpm.ScenarioRun:
    """Scenario of the example with other runs and other keys."""
    content = tomllib.loads((HYL / file).read_text(encoding="utf-8"))
    content.pop("plot")
    result = vpm.Scenario.from_dict({**content, "runs": runs, **changes}, folder=HYL).run()
    if result.failures:
        raise RuntimeError(str(result.failures))
    return result


def drop(model: str, parameters: dict[str, float], **changes: object) -> vpm.Run:
    """The leg falls from 50 mm."""
    if "springs" in model:
        changes = {"references": {}, **changes}
    return scenario("drop.toml", [{"name": "drop", "model": model, "set": parameters}], **changes)["drop"]


def reference() -> list[Row]:
    """Every value of the file: rest on the foot, and the drop with controllers that are sampled every 10 us."""
    model = vpm.Model.load(HYL / "rcm.toml")
    found: dict[str, ArrayLike] = {
        "hyl.contact.kc_SI": model.parameters["foot.stiffness"].value,
        "hyl.contact.cc_SI": model.parameters["foot.damping"].value,
    }
    found |= standing() | falling(model)
    wanted = accepted("hyl")
    if set(wanted) != set(found):
        raise ValueError(f"hyl: these names are on one side only: {sorted(set(wanted) ^ set(found))}")
    return [against(entry, found[name]) for name, entry in wanted.items()]


def standing() -> dict[str, ArrayLike]:
    """Force of the ground, angles (deg) and height of the hip axis above the foot, with a foot without friction."""
    cases = [(p, mass) for p in (150, 300) for mass in (0, 3, 7)]
    runs: list[dict[str, Any]] = [
        {
            "name": f"P{p}.payload{mass}",
            "model": "rcm.toml",
            "set": {**SMOOTH, **gain(p)},
            "with_effects": [{"type": "payload", "at": "carriage", "mass": float(mass)}],
        }
        for p, mass in cases
    ]
    result = scenario("static.toml", runs, duration=16.0, integrator="adaptive(1e-9)")
    found: dict[str, ArrayLike] = {}
    for p, mass in cases:
        run = result[f"P{p}.payload{mass}"]
        angles = [np.degrees(run[f"{joint}_rotation.position"][-1]) for joint in ("hip", "knee")]
        found[f"hyl.static_pose.P{p}.payload{mass}"] = [*angles, run["slider.position"][-1] + run["foot.depth"][-1]]
        found[f"hyl.static_grf.payload{mass}"] = run["foot.normal_force"][-1]
    return found


def falling(model: vpm.Model) -> dict[str, ArrayLike]:
    """Touch-down, peak, heights and impulse of the drop."""
    runs = [
        drop("rcm.toml", gain(p), duration=0.4, time_step=1e-5, integrator="adaptive(1e-8)") for p in (150.0, 300.0)
    ]
    heights = [np.interp([0.15, 0.2, 0.3, 0.4], run.time, run["slider.position"]) for run in runs]
    return {
        "hyl.touchdown": touchdown(runs[0]),
        "hyl.drop.peak_grf": [run["foot.normal_force"].max() for run in runs],
        "hyl.drop.hip_height": np.concatenate(heights),
        "hyl.drop.impulse_balance": max(abs(lost_impulse(model, run)) for run in runs),
    }


def touchdown(run: vpm.Run) -> tuple[float, float]:
    """Time and speed at which the foot reaches the ground, from the last sample before it, in free fall."""
    last = int(np.argmax(run["slider.position"] < STANDING)) - 1
    way, speed = run["slider.position"][last] - STANDING, -run["slider.velocity"][last]
    arrival = np.sqrt(speed**2 + 2.0 * 9.81 * way)
    return float(run.time[last] + (arrival - speed) / 9.81), float(arrival)


def lost_impulse(model: vpm.Model, run: vpm.Run) -> float:
    """Impulse of the ground less that of the weight and the gain of vertical momentum (N s)."""
    position, velocity = ([run[f"{joint}.{what}"][-1] for joint in model.joints] for what in ("position", "velocity"))
    momentum = model.mass_matrix(position)[0] @ velocity
    weight = 9.81 * model.mass_matrix(position)[0, 0]
    impulse = np.trapezoid(run["foot.normal_force"], run.time)
    return float(impulse - weight * run.time[-1] - momentum)


def agreement(case: str, *, integrator: str = "adaptive(1e-9)", **changes: object) -> dict[str, tuple[Array, Array]]:
    """Channels of the package and of the witness over a drop, by name, at the times of the witness."""
    witness = {name: np.array(column) for name, column in values("hyl_witness")[case].items()}
    file, parameters = CASES[case]
    # Controllers every millisecond; the springs have none.
    run = drop(file, parameters, duration=0.4, time_step=1e-3, integrator=integrator, **changes)
    places = np.round(witness["time"] * 1000.0).astype(int)
    return {name: (run[own][places], witness[name]) for name, own in CHANNELS.items() if name in witness}


def witnessed() -> list[Row]:
    """Every case of the witness: all of its channels, each as a share of its largest value."""
    source = "tests/support/hyl_witness.py: Kane's equations, SciPy's DOP853 at 1e-10"
    rows = []
    for case in CASES:
        pairs = [(both, np.abs(both[1]).max()) for both in agreement(case).values()]
        found, expected = (np.concatenate([both[side] / scale for both, scale in pairs]) for side in (0, 1))
        title = f"drop, {case}: height, forces{', pressures' if 'hydraulic' in case else ''}"
        rows.append(row(title, found, expected, "of largest", source, absolute=1e-6))
    return rows
