"""The servo-cylinder of a model file: closed forms, and responses that a Radau method solved."""

import numpy as np
from numpy.typing import ArrayLike

import vpm
from drive_texts import RIG
from hydraulic_reference import AREA, CHIRP, RATIO, STEP, VALUES, chirp, held
from model_texts import changed
from validation.row import Row, accepted, against, row
from vpm.numbers import Array

CHANNELS = ("servo.pressure_a", "servo.pressure_b", "axis.position", "axis.velocity")
BARE = RIG[: RIG.index("[[effects]]")].replace("internal_leakage = 1.7e-13", "")
LONG = (("stroke = { value = 80.0", "stroke = { value = 800.0"), ("value = -40.0", "value = -400.0"))
AIR = ("oil = {", "oil = { air = { fraction = 0.005, exponent = 1.4, reference_pressure = 101325.0 },")


def rig() -> list[Row]:
    """Every row of the rig."""
    return [*_closed_forms(), *_sizes(), *_air(), *_responses(), _recovery()]


def _closed_forms() -> list[Row]:
    model, bare = vpm.Model.from_toml(RIG), vpm.Model.from_toml(BARE)
    state = dict(zip(model.state_names, model.state(), strict=True))
    out, back = _without_load(2e-3), _without_load(-2e-3)
    frequency = float(bare.linearize().frequencies()[0])
    found: dict[str, ArrayLike] = {
        "hyd.Kv": model.parameters["servo.valve.flow_gain"].value,
        "hyd.initial_pressures": [state["servo.chamber_a"], state["servo.chamber_b"]],
        "hyd.noload.extend": out,
        "hyd.noload.retract": back,
        "hyd.speed_ratio": out[2] / back[2],
        "hyd.oil_stiffness": 3.0 * (2.0 * np.pi * frequency) ** 2,
        "hyd.natural_frequency": frequency,
    }
    return [against(VALUES[name], value) for name, value in found.items()]


def _sizes() -> list[Row]:
    """Areas and gain as the linear machine has them: what pressures do to the piston, the valve to the pressures."""
    model = vpm.Model.from_toml(BARE)
    parameters, linear = model.parameters, model.linearize()
    state = dict(zip(model.state_names, linear.state, strict=True))
    row_of = {name: linear.states.index(name) for name in ("axis.velocity", "servo.chamber_a", "servo.chamber_b")}
    pushes = linear.A[row_of["axis.velocity"]]
    mass = model.mass_matrix(model.equilibrium([0.0])[0])[0, 0]
    area_a, area_b = mass * pushes[row_of["servo.chamber_a"]], -mass * pushes[row_of["servo.chamber_b"]]
    give = -linear.A[row_of["servo.chamber_a"], row_of["axis.velocity"]] / area_a
    supply = parameters["pump.pressure"].value
    opened = model.linearize({"servo.spool": 1e-3})
    flow = opened.A[row_of["servo.chamber_a"], opened.states.index("servo.spool")] / give
    gain = flow / np.sqrt(supply - state["servo.chamber_a"])
    wanted = accepted("cylinder")
    found = {
        "hyd.area_ratio": area_b / area_a,
        "hyd.Ap": area_a,
        "hyd.Kv_normalised": gain * parameters["servo.valve.stroke"].value,
    }
    return [against(wanted[name], value) for name, value in found.items()]


def _without_load(current: float) -> list[float]:
    """Pressures, and speed per current, once they are steady."""
    model = changed(BARE, *LONG)
    run = vpm.simulate(model, held(model, 1e-4, np.full(8000, current)), integrator="rosenbrock")
    pressures = [float(run[name][-1]) for name in CHANNELS[:2]]
    return [*pressures, abs(float(run["axis.velocity"][-1]) / current)]


def _air() -> list[Row]:
    """Bulk modulus with air: how fast a chamber's pressure falls as the piston moves away."""
    model = changed(BARE, AIR)
    volume = 2.9e-6 + AREA * 0.04
    rows = []
    for name in [name for name in VALUES if name.startswith("hyd.beta_eff")]:
        pressure = 1e3 * float(name.rpartition(".")[2].removesuffix("kPa"))
        linear = model.linearize({"servo.chamber_a": pressure, "servo.chamber_b": pressure / RATIO})
        slope = linear.A[linear.states.index("servo.chamber_a"), linear.states.index("axis.velocity")]
        rows.append(against(VALUES[name], -slope * volume / AREA))
    return rows


def _responses() -> list[Row]:
    model = vpm.Model.from_toml(RIG)
    time = 2.5e-5 * np.arange(80001)
    step = held(model, 1e-3, np.where(np.arange(101) < 50, 2e-3, -2e-3))
    # A command that is held stands for the middle of its interval.
    sweep = held(model, 2.5e-5, chirp(time + 1.25e-5))
    stepped = vpm.simulate(model, step, integrator="adaptive(1e-8)")
    swept = vpm.simulate(model, sweep, integrator="rosenbrock")
    rows = [against(VALUES[f"hyd.H1.step.t{t:03.0f}ms"], _at(stepped, t)) for t, *_ in STEP]
    return rows + [against(VALUES[f"hyd.H2.chirp.t{t:04.0f}ms"], _at(swept, t)) for t, *_ in CHIRP]


def _at(run: vpm.Run, milliseconds: float) -> Array:
    place = int(np.searchsorted(run.time, 1e-3 * milliseconds - 1e-9))
    return np.array([run[name][place] for name in CHANNELS])


def _recovery() -> Row:
    """Bulk modulus and gain of the valve from a chirp of 0.5 s, from the start values of the published listing."""
    model = vpm.Model.from_toml(RIG)
    current = chirp(1e-3 * np.arange(501))
    seen = vpm.simulate(model, held(model, 1e-3, current), integrator="rosenbrock")
    measured = {name.replace(".", "__"): seen[name] for name in CHANNELS}
    record = held(model, 1e-3, current, **measured)
    start = model.with_parameters({"pump.oil.bulk_modulus": 1e8, "servo.valve.flow_gain": 1e-6})
    fit = vpm.identify(start, record, mode="free_run", setup=vpm.Setup("rosenbrock"))
    names = ("pump.oil.bulk_modulus", "servo.valve.flow_gain")
    error = max(abs(fit[name] / model.parameters[name].value - 1.0) for name in names)
    source = "recomputed: bulk modulus and gain of the valve from a simulated chirp, from 1e8 Pa and 1e-6"
    return row("hyd.greybox.recovery", error, 0.0, "1", source, absolute=1e-4)
