"""Recalibration of a pendulum that carries more than its file says, and of a spring; torques are of closed forms."""

import numpy as np
import pytest

import sledge
import vpm
from model_texts import effect_text, on_rail
from vpm.simulate import Setup

GRAVITY, RATE, SECONDS = 9.81, 100.0, 5.0
#: What the file says: mass, place along the link and beside it, thickness and length as moments about the centre.
MASS, ALONG, BESIDE, THIN, LONG = 5.0, 0.3, 0.01, 0.002, 0.06
#: Torques are those of the samples, between which they go straight.
SMOOTH = Setup(hold="first_order")
FILE = f"""
name = "pendulum"
gravity = [0.0, 0.0, -{GRAVITY}]
[bodies.link]
mass = {{ value = {MASS}, unit = "kg", uncertainty = 0.5 }}
center_of_mass = [{{ value = {ALONG}, uncertainty = 0.03 }}, 0.0, {{ value = {BESIDE}, uncertainty = 0.01 }}]
inertia = [
    {{ value = {THIN}, uncertainty = 0.001 }}, {{ value = {LONG}, uncertainty = 0.02 }},
    {{ value = {LONG}, uncertainty = 0.02 }}, 0.0, 0.0, 0.0,
]
[joints.pin]
type = "revolute"
parent = "world"
child = "link"
axis = [0.0, 1.0, 0.0]
[actuators.motor]
joint = "pin"
gain = 1.0
command_unit = "N m"
"""


def swung(along: float, beside: float, about_pin: float, seed: int) -> vpm.Experiment:
    """Record of a motion, with the torque ``I a - m g (x cos q + z sin q)`` that a link along x needs about y.

    ``along`` and ``beside`` are the first moments m x and m z, kg m.
    """
    rng, time = np.random.default_rng(seed), np.arange(0.0, SECONDS, 1.0 / RATE)
    phases, pulsations = rng.uniform(0.0, 2.0 * np.pi, 3), 2.0 * np.pi * np.array([0.25, 0.6, 1.1])
    waves = np.array([0.8, 0.35, 0.12])[:, None] * np.sin(np.outer(pulsations, time) + phases[:, None])
    q, a = waves.sum(axis=0), -(pulsations**2 @ waves)
    torque = about_pin * a - GRAVITY * (along * np.cos(q) + beside * np.sin(q))
    noise = rng.normal(0.0, (1e-5, 0.02), (time.size, 2)).T
    columns = {"pin.position": q + noise[0], "motor.command": torque + noise[1]}
    return vpm.Experiment.from_arrays(time, columns, model=vpm.Model.from_toml(FILE))


@pytest.mark.parametrize(
    ("load", "place"),
    [
        (0.0, (0.0, 0.0)),
        (1.0, (0.5, -0.2)),  # the common centre of mass lies on the other side of the link's axis
        (2.0, (0.8, -0.1)),  # the moment about y exceeds the file's other two, which nothing shows, taken together
    ],
)
def test_bodies_become_what_the_records_show_of_them(load: float, place: tuple[float, float]) -> None:
    about_pin = LONG + MASS * (ALONG**2 + BESIDE**2) + load * (place[0] ** 2 + place[1] ** 2)
    moments = MASS * ALONG + load * place[0], MASS * BESIDE + load * place[1]
    train, test = (swung(*moments, about_pin, seed) for seed in (1, 2))
    why = vpm.diagnose(vpm.Model.from_toml(FILE), train, test, effects=["spring"], setup=SMOOTH, check=False)
    assert why.verdict in {"parameters_only", "no_disagreement"}
    found = {name: parameter.value for name, parameter in why.model.parameters.items()}
    mass, x, z = (found[f"link.{name}"] for name in ("mass", "center_of_mass.x", "center_of_mass.z"))
    assert (mass * x, mass * z) == pytest.approx(moments, abs=0.01)
    # The load's first moment is 1.6 kg m, and one stated uncertainty of mass or of place makes 0.15 kg m.
    told = [note for note in why.notes if "link.center_of_mass.x" in note and "times the stated uncertainty" in note]
    assert bool(told) == (load > 1.0)
    assert found["link.inertia.yy"] + mass * (x**2 + z**2) == pytest.approx(about_pin, rel=0.01)


#: A motor and what it turns by a spring, without gravity.
ROTOR, SHANK, STIFFNESS = 0.3, 0.25, 250.0
ELASTIC = f"""
name = "series elastic actuator"
gravity = [0.0, 0.0, 0.0]
bodies.rotor = {{ mass = 1.0, inertia = [{ROTOR}, {ROTOR}, {ROTOR}, 0, 0, 0] }}
joints.motor = {{ type = "revolute", parent = "world", child = "rotor", axis = [0, 1, 0] }}
bodies.shank = {{ mass = 1.0, inertia = [{SHANK}, {SHANK}, {SHANK}, 0, 0, 0] }}
joints.coil = {{ type = "revolute", parent = "rotor", child = "shank", axis = [0, 1, 0] }}
actuators.drive = {{ joint = "motor", gain = 1.0, command_unit = "N m" }}

[[effects]]
type = "spring"
at = "coil"
stiffness = {{ value = 200.0, unit = "N m/rad", uncertainty = 50.0 }}
"""


def shaken(seed: int, cubic: float = 0.0) -> vpm.Experiment:
    """Record in which the shank moves by ``q``, its spring by ``d``, and the motor gives what both bodies need.

    Of ``k d + cubic d^3 = -I q''`` derivatives by time follow, and of the motor ``q - d``.
    """
    rng, time = np.random.default_rng(seed), np.arange(0.0, SECONDS, 1.0 / 200.0)
    phases, pulsations = rng.uniform(0.0, 2.0 * np.pi, 3), 2.0 * np.pi * np.array([0.6, 1.4, 2.3])
    angles, size = np.outer(pulsations, time) + phases[:, None], np.array([0.4, 0.15, 0.06])
    q, a = size @ np.sin(angles), -(size * pulsations**2) @ np.sin(angles)
    load, rate = -SHANK * a, SHANK * (size * pulsations**3) @ np.cos(angles)
    curvature = -SHANK * (size * pulsations**4) @ np.sin(angles)
    d = load / STIFFNESS
    for _ in range(20):  # Newton's method
        d -= (STIFFNESS * d + cubic * d**3 - load) / (STIFFNESS + 3.0 * cubic * d**2)
    slope = STIFFNESS + 3.0 * cubic * d**2
    bend = (curvature - 6.0 * cubic * d * (rate / slope) ** 2) / slope
    torque = ROTOR * (a - bend) + SHANK * a
    noise = rng.normal(0.0, (1e-5, 1e-4, 0.01), (time.size, 3)).T
    columns = {
        "motor.position": q - d + noise[0],
        "coil.position": d + noise[1],
        "drive.command": torque + noise[2],
    }
    return vpm.Experiment.from_arrays(time, columns, model=vpm.Model.from_toml(ELASTIC))


def test_a_spring_that_no_effort_of_a_drive_shows_has_the_stiffness_that_its_deflection_shows() -> None:
    why = vpm.diagnose(
        vpm.Model.from_toml(ELASTIC), shaken(1), shaken(2), effects=["bias_force"], setup=SMOOTH, workers=1
    )
    assert why.verdict == "parameters_only"
    assert why.model.parameters["coil.spring.stiffness"].value == pytest.approx(STIFFNESS, rel=0.01)


def test_a_spring_that_hardens_between_a_motor_and_its_load_is_no_ripple() -> None:
    """The spring moves 3 hundredths of a radian where the motor moves 0.6: what may act on it has the spring's size."""
    cubic, effects = 3e4, ["cubic_spring", "torque_ripple"]
    records = (shaken(seed, cubic) for seed in (1, 2))
    why = vpm.diagnose(vpm.Model.from_toml(ELASTIC), *records, effects=effects, setup=SMOOTH, check=False, workers=1)
    assert [(one.name, one.site) for one in why.effects] == [("cubic_spring", "coil")]
    assert "does not show it" in why.effects[0].notes[0]  # no effort of the motor does
    assert why.model.parameters["coil.cubic_spring.stiffness"].value == pytest.approx(cubic, rel=0.05)
    assert why.model.parameters["coil.spring.stiffness"].value == pytest.approx(STIFFNESS, rel=0.02)


def test_a_late_reading_of_what_a_motor_and_its_spring_turn_together_is_not_nothing() -> None:
    """Both readings before it are right, so that no effort is wrong: 5 ms late is 2.5 % of its motion."""
    content = ELASTIC.replace("stiffness = { value = 200.0", "stiffness = { value = 250.0")
    model = vpm.Model.from_toml(content + "[transmissions.knee]\nratios = { motor = 1.0, coil = 1.0 }\n")
    late = [
        record.with_channel("knee.position", shifted, "rad")
        for record in (shaken(1), shaken(2))
        for whole in [record["motor.position"] + record["coil.position"]]
        for shifted in [np.concatenate([whole[:1], whole[:-1]])]
    ]
    why = vpm.diagnose(model, *late, effects=["bias_force"], setup=SMOOTH, check=False, workers=1)
    assert why.verdict == "unexplained"
    assert why.gap["knee.position (observed)"].after > 10.0 * why.gap["knee.position (observed)"].noise_floor
    assert any("no offset, gain or delay of" in note for note in why.notes)


def test_a_fit_of_efforts_that_cannot_see_a_spring_says_which_mode_does() -> None:
    model, record = vpm.Model.from_toml(ELASTIC), shaken(1)
    fit = vpm.identify(model, record)
    assert fit.unidentifiable
    assert any("no effort at coil was compared" in sentence for sentence in fit.warnings)
    other = vpm.identify(model, record, mode="restarts", setup=SMOOTH)
    assert other["coil.spring.stiffness"] == pytest.approx(STIFFNESS, rel=0.01)
    assert not any("was compared" in sentence for sentence in other.warnings)


def test_what_a_residual_shows_only_together_stays_where_an_observer_finds_it_as_stated() -> None:
    """Noise of a deflection, twice differentiated, draws mass from the link to the motor; an observer does not move."""
    link = "{ value = 2.3, uncertainty = 0.2 }"
    gain = "{ value = 4.0, uncertainty = 0.2 }"
    text = on_rail("sledge", link, joint="way", drive="motor", gain=gain)
    text += effect_text("viscous_friction", "way", viscous="{ value = 8.4, uncertainty = 0.8 }")
    spring = {
        "stiffness": "{ value = 2.1e5, uncertainty = 2e4 }",
        "damping": "{ value = 30.0, uncertainty = 20.0 }",
        "inertia": "{ value = 0.75, uncertainty = 0.1 }",
    }
    file = vpm.Model.from_toml(text + effect_text("joint_compliance", "way", **spring))
    first, second = (sledge.wound(seed, logged=True) for seed in (1, 2))
    why = vpm.diagnose(file, first, second, effects=["bias_force"], check=False, workers=1)
    true = {
        "sledge.mass": sledge.LINK,
        "way.compliance.inertia": sledge.MASS - sledge.LINK,
        "way.compliance.stiffness": sledge.STIFFNESS,
    }
    assert why.verdict == "parameters_only"
    for name, value in true.items():
        assert abs(why.model.parameters[name].value - value) < 1.5 * (file.parameters[name].uncertainty or 0.0), name
        assert not any(name in note for note in why.notes)
