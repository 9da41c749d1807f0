"""Rotors, stops, tilted gravity, bending and damping of links, laws of users: against closed forms and differences."""

import numpy as np
import pytest

from quotients import of_residual
from test_split_joints import ARM, commanded, slide
from vpm import EFFECTS, Experiment, Model, simulate
from vpm.catalogue import effects_for_site, register, unregister
from vpm.discrepancy.screening.candidates import candidates
from vpm.errors import ModelError
from vpm.identify import InverseDynamicsProblem

BEAM = """
name = "arm"
gravity = [0.0, 0.0, -9.81]

[bodies.hub]
mass = 1.0
inertia = [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]

[joints.shoulder]
type = "revolute"
parent = "world"
child = "hub"
axis = [0.0, 1.0, 0.0]

[beams.boom]
parent = "hub"
length = 0.8
level = "rigid"
deforms = ["bending_y"]
material = { young = 7e10, poisson = 0.3, density = 2700.0 }
section = { shape = "rectangle", width = 0.004, height = 0.03 }
damping = { stiffness = 1e-4 }

[gauges.root]
beam = "boom"
at = 0.1
x = 0.002
y = 0.0

[actuators.drive]
joint = "shoulder"
gain = { value = 1.0, unit = "N m/A" }
command_unit = "A"
"""
MOMENT = 0.03 * 0.004**3 / 12.0


def arm() -> Model:
    return Model.from_toml(ARM)


def vanishes(truth: Model, nominal: Model, record: Experiment, share: float, cutoff: float = 60.0) -> None:
    """The balance of the truth is small beside that of the nominal model."""
    data = InverseDynamicsProblem(nominal, [record], cutoff=cutoff)
    with_it, _ = data.evaluate(truth, truth.theta)
    without, _ = data.evaluate(nominal, nominal.theta)
    assert np.linalg.norm(with_it) < share * np.linalg.norm(without)


def slopes_are_exact(truth: Model, data: InverseDynamicsProblem, steps: dict[str, float]) -> None:
    """Derivatives of the balance against central differences."""
    columns = [truth.index(name) for name in steps]
    _, slopes = data.evaluate(truth, truth.theta, columns)
    for k, (column, step) in enumerate(zip(columns, steps.values(), strict=True)):
        difference = of_residual(data, truth, column, step)
        assert np.linalg.norm(difference - slopes[:, k]) < 1e-4 * np.linalg.norm(difference)


# ---- rotors ----------------------------------------------------------------------------------------------------------


def test_a_rotor_adds_to_its_own_entry_of_the_mass_matrix_alone() -> None:
    model = arm().with_effect("rotor_inertia", at="elbow", inertia=0.07)
    added = model.mass_matrix([0.2, -0.9]) - arm().mass_matrix([0.2, -0.9])
    assert added == pytest.approx(np.diag([0.0, 0.07]), abs=1e-15)
    state = ([0.2, -0.9], [1.0, -2.0], [3.0, 5.0])
    more = np.subtract(model.inverse_dynamics(*state), arm().inverse_dynamics(*state))
    assert more == pytest.approx([0.0, 0.07 * 5.0], abs=1e-12)
    forward = model.forward_dynamics(state[0], state[1], model.inverse_dynamics(*state))
    assert forward == pytest.approx(state[2], rel=1e-9)


def test_a_rotor_adds_to_one_that_is_described_in_elastic_machines_as_well() -> None:
    text = BEAM.replace('type = "revolute"', 'type = "revolute"\nrotor_inertia = { value = 0.02, unit = "kg m^2" }')
    bare, elastic = Model.from_toml(BEAM).at("strain(2)"), Model.from_toml(text).at("strain(2)")
    model = elastic.with_effect("rotor_inertia", at="shoulder", inertia=0.05)
    q = np.zeros(len(model.coordinates))
    added = model.mass_matrix(q) - bare.mass_matrix(q)
    expected = np.zeros_like(added)
    expected[0, 0] = 0.07
    assert added == pytest.approx(expected, abs=1e-12)


# ---- gravity ---------------------------------------------------------------------------------------------------------


def test_a_tilt_of_gravity_is_gravity_described_tilted() -> None:
    first, second = 0.1, -0.3
    turned = np.array([[1, 0, 0], [0, np.cos(first), -np.sin(first)], [0, np.sin(first), np.cos(first)]])
    about_y = np.array([[np.cos(second), 0, np.sin(second)], [0, 1, 0], [-np.sin(second), 0, np.cos(second)]])
    content = arm().to_dict() | {"gravity": (about_y @ turned @ np.array([0.0, 0.0, -9.81])).tolist()}
    model = arm().with_effect("gravity_tilt", at="world", first=first, second=second)
    state = ([0.2, -0.9], [1.0, -2.0], [3.0, 5.0])
    assert model.inverse_dynamics(*state) == pytest.approx(Model.from_dict(content).inverse_dynamics(*state), rel=1e-12)
    assert model.energy(*state[:2]) == pytest.approx(Model.from_dict(content).energy(*state[:2]), rel=1e-12)
    assert Model.from_toml(model.to_toml()) == model


def test_small_tilts_are_linear_and_neutral_at_zero() -> None:
    state = ([0.2, -0.9], [0.0, 0.0], [0.0, 0.0])
    level = np.array(arm().inverse_dynamics(*state))

    def effort(angle: float) -> np.ndarray:
        tilted = arm().with_effect("gravity_tilt", at="world", second=angle)
        return np.array(tilted.inverse_dynamics(*state)) - level

    assert effort(0.0) == pytest.approx(np.zeros(2), abs=1e-15)
    assert effort(2e-3) == pytest.approx(2.0 * effort(1e-3), rel=5e-3)
    # Gravity turned by +angle about y is the arm turned by -angle.
    back = np.array(arm().inverse_dynamics([0.2 - 1e-3, -0.9], [0.0, 0.0], [0.0, 0.0])) - level
    assert effort(1e-3) == pytest.approx(back, rel=1e-9)


def test_without_gravity_nothing_can_be_tilted() -> None:
    assert slide().sites("world") == ()
    with pytest.raises(ModelError, match="world"):
        slide().with_effect("gravity_tilt", at="world", first=0.1)


# ---- stops -----------------------------------------------------------------------------------------------------------


def test_a_joint_pushed_into_its_stop_rests_where_the_spring_holds_it() -> None:
    model = slide().with_effect("end_stop", at="axis", stiffness=4e3, damping=2.0, high=0.05)
    time = 1e-3 * np.arange(8000)
    record = Experiment.from_arrays(
        time, {"axis.position": 0.0 * time, "drive.command": 8.0 + 0.0 * time}, model=model, name="push"
    )
    run = simulate(model, record, "free_run", initial_state=np.array([0.049, 0.0]))
    assert run["axis.position"][-1] == pytest.approx(0.05 + 8.0 / 4e3, rel=1e-4)
    speed = run["axis.velocity"]
    assert np.max(np.abs(speed[-500:])) < 0.1 * np.max(np.abs(speed))


def test_a_bounce_loses_energy_and_the_stop_never_pulls() -> None:
    model = slide().with_effect("end_stop", at="axis", stiffness=4e3, damping=0.5, high=0.05, low=-0.05)
    _, states, _ = model.core.simulate(
        model.theta, np.array([0.0, 1.0]), np.zeros((2000, 1)), 1e-3, 8, "rosenbrock", []
    )
    total = np.array([sum(model.energy(x[:1], x[1:2])) for x in states])
    assert np.all(np.diff(total) < 1e-6)
    assert total[-1] < 0.7 * total[0]
    generator = np.random.default_rng(4)
    for q, v in generator.uniform([-0.1, -5.0], [0.1, 5.0], (200, 2)):
        if abs(q) > 0.051:  # what the joint needs of its drive against the stop
            assert model.inverse_dynamics([q], [v], [0.0])[0] * q > 0.0
    assert Model.from_toml(model.to_toml()) == model


def test_stops_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ModelError, match=r"low is 0\.2, but the upper end is 0\.1"):
        slide().with_effect("end_stop", at="axis", stiffness=1.0, low=0.2, high=0.1)


@pytest.mark.parametrize(
    ("name", "values", "steps"),
    [
        ("rotor_inertia", {"inertia": 0.4}, {"axis.rotor.inertia": 1e-4}),
        (
            "end_stop",
            {"stiffness": 500.0, "damping": 0.3, "high": 0.1, "width": 2e-3},
            {"axis.end_stop.stiffness": 0.1, "axis.end_stop.damping": 1e-4, "axis.end_stop.high": 1e-6},
        ),
    ],
)
def test_the_balance_of_a_slide_vanishes(name: str, values: dict[str, float], steps: dict[str, float]) -> None:
    truth = slide().with_effect(name, at="axis", **values)
    record = commanded(truth)
    vanishes(truth, slide(), record, 0.01, cutoff=150.0)
    slopes_are_exact(truth, InverseDynamicsProblem(slide(), [record], cutoff=150.0), steps)


# ---- links -----------------------------------------------------------------------------------------------------------


def swung(truth: Model) -> Experiment:
    """Free run of the beam's arm under a sum of sines; the log holds the angle and the strain."""
    time = 1e-3 * np.arange(5000)
    begin = np.minimum(time, 1.0)
    command = begin**2 * (3.0 - 2.0 * begin) * (np.sin(6.0 * time) + 0.6 * np.sin(23.0 * time + 1.0))
    outputs, _, _ = truth.core.simulate(
        truth.theta, np.zeros(truth.core.n_states), command[:, None], 1e-3, 2, "linearly_implicit", []
    )
    names = ("shoulder.position", "root.strain")
    seen = {name: outputs[:, truth.output_channels.index(name)] for name in names}
    return Experiment.from_arrays(time, {**seen, "drive.command": command}, model=truth, name="swing")


def test_a_rigid_beam_that_bends_is_the_elastic_beam_of_that_stiffness() -> None:
    stiffness = 3.0 * 7e10 * MOMENT / 0.8
    bent = Model.from_toml(BEAM).with_effect("link_flexibility", at="boom", stiffness=stiffness, time=0.0)
    elastic = Model.from_toml(BEAM).at("strain(2)")
    assert bent.levels == {"boom": "strain(2)"}
    assert bent.coordinates == elastic.coordinates
    q = np.zeros(len(bent.coordinates))
    assert bent.mass_matrix(q) == pytest.approx(elastic.mass_matrix(q), rel=1e-12)
    mine, other = (np.sort(np.linalg.eigvals(model.linearize().A).imag)[-1] for model in (bent, elastic))
    assert mine == pytest.approx(other, rel=1e-9)
    assert Model.from_toml(bent.to_toml()) == bent
    assert bent.without_effect("link_flexibility", at="boom").levels == {"boom": "rigid"}
    softer = bent.with_parameters({"boom.flexibility.stiffness": 0.25 * stiffness})
    assert np.sort(np.linalg.eigvals(softer.linearize().A).imag)[-1] < 0.7 * mine


def test_the_balance_and_the_strain_of_a_bending_beam_vanish() -> None:
    nominal = Model.from_toml(BEAM)
    truth = nominal.with_effect("link_flexibility", at="boom", stiffness=30.0, time=2e-3)
    record = swung(truth)
    vanishes(truth, nominal, record, 0.02)
    steps = {"boom.flexibility.stiffness": 1e-3, "boom.flexibility.time": 1e-6}
    slopes_are_exact(truth, InverseDynamicsProblem(nominal, [record], cutoff=60.0), steps)


def test_structural_damping_adds_to_what_is_described() -> None:
    nominal = Model.from_toml(BEAM).at("strain(2)")
    model = nominal.with_effect("structural_damping", at="boom", time=3e-4)
    described = Model.from_toml(BEAM.replace("stiffness = 1e-4", "stiffness = 4e-4")).at("strain(2)")
    mine, other, before = (np.linalg.eigvals(m.linearize().A) for m in (model, described, nominal))
    assert np.sort_complex(mine) == pytest.approx(np.sort_complex(other), rel=1e-9, abs=1e-9)
    assert mine.real.min() < 2.0 * before.real.min()
    assert Model.from_toml(model.to_toml()) == model
    assert model.at("rigid").inverse_dynamics([0.1], [0.2], [0.3]) == pytest.approx(
        nominal.at("rigid").inverse_dynamics([0.1], [0.2], [0.3])
    )


def test_a_diagnosis_looks_for_bending_of_rigid_links_and_damping_of_elastic_ones() -> None:
    nominal = Model.from_toml(BEAM)
    record = swung(nominal.with_effect("link_flexibility", at="boom", stiffness=30.0, time=2e-3))
    for model, present in ((nominal, "link_flexibility"), (nominal.at("strain(2)"), "structural_damping")):
        data = InverseDynamicsProblem(model, [record], cutoff=60.0)
        residual, _ = data.evaluate(model, model.theta)
        found = {candidate.label for candidate in candidates(model, data, residual)}
        assert f"{present} at boom" in found
        assert {"gravity_tilt at world", "rotor_inertia at shoulder", "end_stop at shoulder"} <= found
        assert ({"link_flexibility at boom", "structural_damping at boom"} & found) == {f"{present} at boom"}


# ---- laws of users ---------------------------------------------------------------------------------------------------


def test_a_law_of_a_user_is_an_effect_like_all_others() -> None:
    effect = register(
        "drag",
        law="-drag*v*abs(v) - bump*tanh(q/width)",
        sizes={"drag": "{E} s^2/{C}^2", "bump": "{E}"},
        shapes={"width": ("{C}", 0.05)},
        not_negative=("drag", "width"),
        sentence="{at} moves through a fluid: {drag}, and over a bump of {bump} within {width}.",
    )
    try:
        assert EFFECTS["drag"] is effect
        assert effect in effects_for_site("joint")
        assert [p.linear for p in effect.parameters] == [True, True, False]
        truth = slide().with_effect("drag", at="axis", drag=3.0, bump=0.5)
        assert truth.parameters["axis.drag.drag"].unit == "N s^2/m^2"
        assert truth.inverse_dynamics([0.03], [-0.7], [0.0])[0] == pytest.approx(
            -3.0 * 0.49 + 0.5 * np.tanh(0.6), rel=1e-12
        )
        assert Model.from_toml(truth.to_toml()) == truth
        record = commanded(truth)
        vanishes(truth, slide(), record, 0.01, cutoff=150.0)
        data = InverseDynamicsProblem(slide(), [record], cutoff=150.0)
        slopes_are_exact(truth, data, {"axis.drag.drag": 1e-4, "axis.drag.bump": 1e-4, "axis.drag.width": 1e-7})
        residual, _ = data.evaluate(slide(), slide().theta)
        assert "drag at axis" in {candidate.label for candidate in candidates(slide(), data, residual)}
    finally:
        unregister("drag")
    assert "drag" not in EFFECTS
    with pytest.raises(ModelError, match="no effect"):
        Model.from_toml(truth.to_toml())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"name": "spring"}, "already"),
        ({"name": "My Law"}, "no name"),
        ({"law": "-a*v**0.5"}, "does not know"),
        ({"law": "-a*"}, "no expression"),
        ({"law": "-a*b"}, "names b"),
        ({"law": "1 + a*v"}, "sizes are 0"),
        ({"law": "a*" * 20 + "v"}, "write it shorter"),
        ({"sizes": {"a": "{E} parsec"}}, "cannot be read"),
        ({"sizes": {}}, "no size"),
        ({"sizes": {"q": "{E}"}}, "named"),
        ({"sentence": "It moves {b}."}, "cannot be filled in"),
        ({"sentence": "It moves."}, "put {at} into it"),
    ],
)
def test_a_law_that_cannot_be_used_is_refused_in_one_sentence(change: dict[str, object], words: str) -> None:
    entry = {"name": "law", "law": "-a*v", "sizes": {"a": "{E} s/{C}"}, "sentence": "{at} moves with {a}."} | change
    with pytest.raises(ModelError, match=words):
        register(**entry)  # type: ignore[arg-type]


# ---- drives with states of their own ---------------------------------------------------------------------------------


def test_a_motor_with_a_current_drives_a_joint_that_winds_up() -> None:
    motor = {
        "type": "dc_motor",
        "joint": "axis",
        "command_unit": "V",
        "resistance": 1.0,
        "time_constant": 2e-3,
        "torque_constant": 0.5,
        "gear_ratio": 1.0,
    }
    content = slide().to_dict() | {"actuators": {"drive": motor}}
    content["joints"]["axis"]["type"] = "revolute"
    content["bodies"]["link"]["inertia"] = [2.0, 2.0, 2.0, 0.0, 0.0, 0.0]
    nominal = Model.from_dict(content)
    truth = nominal.with_effect("joint_compliance", at="axis", stiffness=3000.0, damping=8.0, inertia=0.5)
    record = commanded(truth)
    vanishes(truth, nominal, record, 0.01, cutoff=150.0)
    data = InverseDynamicsProblem(nominal, [record], cutoff=150.0)
    steps = {"axis.compliance.stiffness": 0.1, "axis.compliance.inertia": 1e-4, "drive.torque_constant": 1e-6}
    slopes_are_exact(truth, data, steps)
