"""Seals whose dry friction turns round at another speed than the model file says: no second friction is missing."""

import numpy as np
from scipy.integrate import solve_ivp

import vpm

AREA, RATIO, STROKE, LINE = 9.5e-3, 0.6, 0.6, 5e-4  # m^2, -, m, m^3
SUPPLY, TANK, BULK, GAIN, FREQUENCY = 18e6, 4e5, 1.0e9, 8e-9, 60.0  # Pa, Pa, Pa, m^3/(s % sqrt(Pa)), rad/s
MASS, VISCOUS, DRY, TURNING = 4000.0, 6000.0, 2500.0, 8e-3  # kg, N s/m, N, m/s
FILE = f"""
    name = "press"
    gravity = [0.0, 0.0, -9.81]
    bodies.ram = {{ mass = {{ value = 3600.0, uncertainty = 500.0 }} }}
    joints.axis = {{ type = "prismatic", parent = "world", child = "ram", axis = [1.0, 0.0, 0.0] }}
    [supplies.pump]
    pressure = {SUPPLY}
    tank_pressure = {TANK}
    oil = {{ bulk_modulus = {BULK} }}
    [actuators.servo]
    type = "hydraulic"
    joint = "axis"
    supply = "pump"
    retracted_length = {-STROKE / 2}
    command_unit = "%"
    valve = {{ flow_gain = {100.0 * GAIN}, frequency = {FREQUENCY}, damping = 0.8, stroke = 1.0 }}
    cylinder = {{ area = {AREA}, area_ratio = {RATIO}, stroke = {STROKE}, line_a = {LINE}, line_b = {LINE} }}
    [actuators.servo.friction]
    viscous = {{ value = 5000.0, uncertainty = 2500.0 }}
    coulomb = {{ value = 2000.0, uncertainty = 1000.0 }}
"""


def plant(time: float, state: np.ndarray, rhythm: float) -> list[float]:
    """A mass on a cylinder that follows two sines by its valve, by the equations of a textbook (Merritt 1967)."""
    x, v, z, rate = state[:4]
    pa, pb = 1e5 * state[4:]
    wanted = 0.12 * np.sin(rhythm * time) + 0.03 * np.sin(3.1 * rhythm * time)
    ahead = rhythm * (0.12 * np.cos(rhythm * time) + 0.093 * np.cos(3.1 * rhythm * time))
    command = np.clip(ahead * AREA / (GAIN * np.sqrt(8e6)) + 200.0 * (wanted - x), -100.0, 100.0)

    def flow(drop: float) -> float:
        return float(GAIN * z * np.sign(drop) * np.sqrt(abs(drop)))

    into, out = (flow(SUPPLY - pa), flow(pb - TANK)) if z > 0.0 else (flow(pa - TANK), flow(SUPPLY - pb))
    force = AREA * (pa - RATIO * pb) - VISCOUS * v - DRY * np.tanh(v / TURNING)
    rise = BULK / (LINE + AREA * (STROKE / 2 + x)) * (into - AREA * v)
    fall = BULK / (LINE + RATIO * AREA * (STROKE / 2 - x)) * (RATIO * AREA * v - out)
    spool = FREQUENCY**2 * (command - z) - 1.6 * FREQUENCY * rate
    return [v, force / MASS, rate, spool, 1e-5 * rise, 1e-5 * fall]


def record(model: vpm.Model, rhythm: float, seed: int) -> vpm.Experiment:
    time, drawn = np.arange(1600) / 200.0, np.random.default_rng(seed)
    begun = [0.0, 0.0, 0.0, 0.0, 30.0, 50.0]
    solved = solve_ivp(plant, (0.0, time[-1]), begun, "LSODA", time, args=(rhythm,), rtol=1e-7, max_step=0.01)
    x, _, _, _, pa, pb = solved.y
    wanted = 0.12 * np.sin(rhythm * time) + 0.03 * np.sin(3.1 * rhythm * time)
    ahead = rhythm * (0.12 * np.cos(rhythm * time) + 0.093 * np.cos(3.1 * rhythm * time))
    values = {
        "axis.position": x + 1e-5 * drawn.standard_normal(time.size),
        "servo.pressure_a": 1e5 * (pa + 0.1 * drawn.standard_normal(time.size)),
        "servo.pressure_b": 1e5 * (pb + 0.1 * drawn.standard_normal(time.size)),
        "servo.command": 0.01 * (ahead * AREA / (GAIN * np.sqrt(8e6)) + 200.0 * (wanted - x)),
    }
    return vpm.Experiment.from_arrays(time, values, name=f"log{seed}", model=model)


def test_a_wrong_transition_velocity_of_seals_is_no_second_friction() -> None:
    model = vpm.Model.from_toml(FILE)
    logs = [record(model, rhythm, seed) for rhythm, seed in ((1.3, 1), (0.9, 2))]
    why = vpm.diagnose(model, *logs, effects=["coulomb_friction"], check=False, workers=1)
    assert why.effects == ()
    assert np.isclose(why.model.parameters["servo.friction.coulomb"].value, DRY, rtol=0.05)
    assert np.isclose(why.model.parameters["servo.friction.transition_velocity"].value, TURNING, rtol=0.2)
