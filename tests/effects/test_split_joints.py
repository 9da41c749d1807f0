"""Wind-up, play and bending: joints that effects split, against closed forms, in files and in every mode."""

import itertools

import numpy as np
import pytest

from model_texts import on_rail, two_links
from quotients import of_residual
from vpm import Experiment, Model, simulate
from vpm.diagnosing import diagnose
from vpm.discrepancy.screening.compliance_and_stop_start import logged_swing
from vpm.errors import ModelError
from vpm.identify import InverseDynamicsProblem, identify

J, L, K = 0.5, 2.0, 3000.0

SLIDE = (
    on_rail("link", "{ value = 2.0, uncertainty = 0.2 }", gain='{ value = 1.0, unit = "N/A" }') + 'command_unit = "A"\n'
)

UPPER = "mass = 2.0\ncenter_of_mass = [0.0, 0.0, -0.3]\ninertia = [0.02, 0.02, 0.01, 0.0, 0.0, 0.0]"
LOWER = "mass = 1.0\ncenter_of_mass = [0.0, 0.0, -0.2]\ninertia = [0.01, 0.01, 0.005, 0.0, 0.0, 0.0]"
ARM = f"""{two_links(UPPER, LOWER, "[0.0, 0.0, -0.6]", axis="[0.0, 1.0, 0.0]", gravity="[0.0, 0.0, -9.81]")}
[actuators.first]
joint = "shoulder"
gain = {{ value = 1.0, unit = "N m/A" }}
command_unit = "A"

[actuators.second]
joint = "elbow"
gain = {{ value = 1.0, unit = "N m/A" }}
command_unit = "A"
"""

SPLITS = {
    "joint_compliance": {"stiffness": K, "damping": 8.0, "inertia": J},
    "backlash": {"gap": 5e-4, "stiffness": 2e4, "damping": 40.0, "width": 2.5e-5, "inertia": J},
}


def slide() -> Model:
    return Model.from_toml(SLIDE)


def frequencies(model: Model, held: tuple[str, ...] = ()) -> list[float]:
    """Natural frequencies without damping (rad/s), joints in ``held`` not moving, by differences of the effort."""
    keep = [k for k, name in enumerate(model.joints) if name not in held]
    n = len(model.joints)
    step = 1e-5
    stiffness = np.zeros((n, n))
    for k in range(n):
        q = np.zeros(n)
        q[k] = step
        stiffness[:, k] = (
            model.inverse_dynamics(q, np.zeros(n), np.zeros(n)) - model.inverse_dynamics(-q, np.zeros(n), np.zeros(n))
        ) / (2.0 * step)
    mass = model.mass_matrix(np.zeros(n))[np.ix_(keep, keep)]
    squares = np.linalg.eigvals(np.linalg.solve(mass, stiffness[np.ix_(keep, keep)])).real
    return sorted(np.sqrt(np.maximum(squares, 0.0)).tolist())


def commanded(model: Model, seed: int = 1, length: int = 6000) -> Experiment:
    """Free run from rest under a sum of sines that begins gently; the log holds the motor side."""
    generator, time = np.random.default_rng(seed), 1e-3 * np.arange(length)
    parts = zip(generator.uniform(1, 4, 6), generator.uniform(0.5, 8, 6), generator.uniform(0, 6, 6), strict=True)
    begin = np.minimum(time, 1.0)
    command = begin**2 * (3.0 - 2.0 * begin) * sum(a * np.sin(2.0 * np.pi * f * time + p) for a, f, p in parts)
    outputs, _, _ = model.core.simulate(
        model.theta, np.zeros(model.core.n_states), command[:, None], 1e-3, 4, "rosenbrock", []
    )
    position = outputs[:, model.output_channels.index("axis.position")]
    return Experiment.from_arrays(time, {"axis.position": position, "drive.command": command}, model=model, name="run")


def test_two_masses_on_a_spring_have_their_closed_form_frequencies() -> None:
    model = slide().with_effect("joint_compliance", at="axis", **SPLITS["joint_compliance"])
    assert model.joints == ("axis", "axis_deflection")
    assert model.added_joints == ("axis_deflection",)
    free, held = frequencies(model), frequencies(model, held=("axis",))
    assert free == pytest.approx([0.0, np.sqrt(K * (1.0 / J + 1.0 / L))], abs=1e-3)
    assert held == pytest.approx([np.sqrt(K / L)])
    poles = np.linalg.eigvals(model.linearize().A)
    swinging = poles[np.argmax(poles.imag)]
    assert -swinging.real == pytest.approx(0.5 * 8.0 * (1.0 / J + 1.0 / L), rel=1e-9)
    assert abs(swinging) == pytest.approx(np.sqrt(K * (1.0 / J + 1.0 / L)), rel=1e-9)


def test_far_stiffer_than_the_motion_a_split_joint_is_the_rigid_one_with_a_rotor() -> None:
    arm = Model.from_toml(ARM)
    soft = arm.with_effect("joint_compliance", at="elbow", stiffness=1e7, damping=10.0, inertia=0.03)
    rigid = arm.with_effect("rotor_inertia", at="elbow", inertia=0.03)
    assert soft.joints == ("shoulder", "elbow", "elbow_deflection")
    whole = soft.mass_matrix([0.3, 0.7, 0.0])
    assert whole[:2, :2] == pytest.approx(rigid.mass_matrix([0.3, 0.7]), rel=1e-12)
    own = arm.mass_matrix([0.3, 0.7])
    assert whole[2] == pytest.approx([own[0, 1], own[1, 1], own[1, 1]], rel=1e-12)


@pytest.mark.parametrize("name", SPLITS)
def test_files_keep_what_splits_a_joint(name: str) -> None:
    model = slide().with_effect(name, at="axis", **SPLITS[name])
    again = Model.from_toml(model.to_toml())
    assert again == model
    assert again.joints == model.joints
    assert model.without_effect(name, at="axis") == slide()
    assert model.core.n_states == 4
    other = model.with_parameters({f"axis.{model.effects[0].type.group}.damping": 3.0})
    assert other.core is model.core


@pytest.mark.parametrize("name", SPLITS)
def test_the_balance_vanishes_with_the_effect_and_not_without(name: str) -> None:
    truth = slide().with_effect(name, at="axis", **SPLITS[name])
    data = InverseDynamicsProblem(slide(), [commanded(truth)], cutoff=150.0)
    with_it, slopes = data.evaluate(truth, truth.theta, list(range(len(truth.theta))))
    without, _ = data.evaluate(slide(), slide().theta)
    assert np.linalg.norm(with_it) < 0.005 * np.linalg.norm(without)
    for parameter in ("stiffness", "damping", "inertia"):
        column = truth.index(f"axis.{truth.effects[0].type.group}.{parameter}")
        difference = of_residual(data, truth, column, 1e-5 * truth.theta[column])
        assert np.linalg.norm(difference - slopes[:, column]) < 1e-4 * np.linalg.norm(difference)


def test_every_mode_runs_and_says_what_the_free_run_said() -> None:
    truth = slide().with_effect("joint_compliance", at="axis", **SPLITS["joint_compliance"])
    record = commanded(truth)
    for mode in ("free_run", "restarts"):
        run = simulate(truth, record, mode)
        assert np.max(np.abs(run["axis.position"] - run.measured[:, run.channels.index("axis.position")])) < 1e-4
    balance = simulate(truth, record, "inverse_dynamics")
    own = balance.channels.index("axis.effort")
    assert np.max(np.abs(balance.values[:, own] - balance.measured[:, own])) < 0.02 * np.ptp(balance.values[:, own])
    along = simulate(truth, record, "prescribed_motion", cutoff=150.0)
    assert "axis_deflection.position" in along.channels
    fit = identify(
        truth.with_parameters({"axis.compliance.stiffness": 3600.0}),
        record,
        ["axis.compliance.stiffness", "axis.compliance.damping"],
        mode="restarts",
    )
    assert fit.model.parameters["axis.compliance.stiffness"].value == pytest.approx(K, rel=0.01)


def test_energy_is_kept_without_damping_and_lost_with_it() -> None:
    for damping, share in ((0.0, 0.0), (8.0, 1.0)):
        model = slide().with_effect("joint_compliance", at="axis", stiffness=K, damping=damping, inertia=J)
        state = np.array([0.0, 0.01, 0.0, 0.0])
        _, states, _ = model.core.simulate(model.theta, state, np.zeros((3000, 1)), 1e-3, 4, "rosenbrock", [])
        energies = [sum(model.energy(x[:2], x[2:4])) for x in states[::300]]
        assert energies[0] == pytest.approx(0.5 * K * 0.01**2, rel=1e-9)
        if share:
            assert all(later < earlier for earlier, later in itertools.pairwise(energies[:4]))
        else:
            assert energies == pytest.approx([energies[0]] * len(energies), rel=1e-3)


def test_the_wind_up_of_a_hanging_arm_starts_as_gravity_leaves_it() -> None:
    arm = Model.from_toml(ARM).with_effect("joint_compliance", at="elbow", stiffness=50.0, damping=1.0, inertia=0.01)
    time = 1e-3 * np.arange(400)
    held = {"shoulder.position": 0.0 * time, "elbow.position": 0.5 + 0.0 * time}
    hold = {"first.command": 0.0 * time, "second.command": 0.0 * time}
    record = Experiment.from_arrays(time, {**held, **hold}, model=arm, name="held")
    start = simulate(arm, record, "free_run")
    wind_up = start["elbow_deflection.position"][0]
    assert 50.0 * wind_up == pytest.approx(-1.0 * 9.81 * 0.2 * np.sin(0.5 + wind_up), rel=1e-6)


def test_a_joint_that_winds_up_and_a_link_that_bends_cannot_be_one_behind_the_other() -> None:
    wound = Model.from_toml(ARM).with_effect("joint_compliance", at="elbow", stiffness=50.0, inertia=0.01)
    with pytest.raises(ModelError, match='splits joint "elbow" again, after joint_compliance'):
        wound.with_effect("link_flexibility", at="lower", stiffness=80.0, time=1e-3, inertia=0.01)


def test_play_at_a_joint_without_an_actuator_is_the_joint_itself() -> None:
    content = slide().to_dict()
    del content["actuators"]
    model = Model.from_dict(content).with_effect("backlash", at="axis", gap=0.01, stiffness=100.0)
    assert model.joints == ("axis",)
    assert model.added_joints == ()


def test_a_body_that_bends_turns_about_its_root() -> None:
    arm = Model.from_toml(ARM).with_effect("link_flexibility", at="lower", stiffness=80.0, time=1e-3, inertia=0.01)
    assert arm.joints == ("shoulder", "elbow", "lower_bending")
    own = 0.01 + 1.0 * 0.2**2
    # The spring and gravity at the hanging position.
    held = frequencies(arm, held=("shoulder", "elbow"))
    assert held == pytest.approx([np.sqrt((80.0 + 9.81 * 0.2) / own)], rel=1e-6)
    assert Model.from_toml(arm.to_toml()) == arm


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        ([("joint_compliance", "axis", {"stiffness": K})], "effects.0..inertia is missing"),
        (
            [("joint_compliance", "axis", SPLITS["joint_compliance"]), ("backlash", "axis", SPLITS["backlash"])],
            "effects.1..stiffness is that of joint_compliance at axis, which backlash is in series with; leave it out",
        ),
    ],
)
def test_what_cannot_be_split_is_refused_in_one_sentence(
    effects: list[tuple[str, str, dict[str, float]]], words: str
) -> None:
    content = slide().to_dict()
    content["effects"] = [{"type": name, "at": at, **values} for name, at, values in effects]
    with pytest.raises(ModelError, match=words):
        Model.from_dict(content)


def test_a_name_that_is_taken_is_refused() -> None:
    text = SLIDE.replace("drive", "axis_deflection")
    with pytest.raises(ModelError, match="rename"):
        Model.from_toml(text).with_effect("joint_compliance", at="axis", **SPLITS["joint_compliance"])


def test_effects_sit_at_the_motor_side_alone() -> None:
    model = slide().with_effect("joint_compliance", at="axis", **SPLITS["joint_compliance"])
    assert model.sites("joint") == ("axis",)
    with pytest.raises(ModelError, match="no joint of the model"):
        model.with_effect("viscous_friction", at="axis_deflection", viscous=1.0)


def test_a_motor_side_that_nobody_knows_begins_with_a_share_of_what_moves() -> None:
    model = slide().with_effect("joint_compliance", at="axis", stiffness=K)
    assert model.parameters["axis.compliance.inertia"].value == pytest.approx(0.1 * L)
    assert model.parameters["axis.compliance.inertia"].adjustable
    described = SLIDE.replace('type = "prismatic"', 'type = "prismatic"\nrotor_inertia = { value = 0.4, unit = "kg" }')
    known = Model.from_toml(described).with_effect("joint_compliance", at="axis", stiffness=K)
    assert known.parameters["axis.compliance.inertia"].value == 0.0
    assert known.mass_matrix([0.0, 0.0]) == pytest.approx(np.array([[2.4, 2.0], [2.0, 2.0]]))


def wound_up(seed: int) -> Experiment:
    """A motor's motion with what a spring of stiffness K behind it does, wave by wave, in closed form."""
    generator, damping = np.random.default_rng(seed), 8.0
    time = 2e-3 * np.arange(5000)
    rates = 2.0 * np.pi * generator.uniform(0.5, 5.0, 8)
    sizes = 0.02 * np.exp(2j * np.pi * generator.uniform(size=8))
    bent = L * rates**2 / (K - L * rates**2 + 1j * damping * rates) * sizes
    force = -J * rates**2 * sizes - (K + 1j * damping * rates) * bent
    position, deflection, effort = (np.real(np.exp(1j * np.outer(time, rates)) @ each) for each in (sizes, bent, force))
    values = {"axis.position": position, "drive.command": effort, "axis_deflection.position": deflection}
    noisy = {name: x + 1e-4 * x.std() * generator.standard_normal(x.size) for name, x in values.items()}
    return Experiment.from_arrays(time, noisy, model=slide(), name=f"run {seed}")


@pytest.mark.nightly
def test_a_logged_deflection_shows_what_a_rigid_model_lacks() -> None:
    record = wound_up(1)
    assert record.unit("axis_deflection.position") == "m"
    problem = InverseDynamicsProblem(slide(), [record])
    assert problem.shown == ("axis_deflection.position",)
    assert np.std(problem.evaluate(slide(), slide().theta)[0][problem.blocks[1].samples]) == pytest.approx(1.0, rel=0.1)
    effects = ["viscous_friction", "spring", "joint_compliance"]
    found = diagnose(slide(), record, wound_up(2), effects=effects)
    assert [(e.name, e.site) for e in found.effects] == [("joint_compliance", "axis")]
    values = {p.name: p.value for p in found.effects[0].parameters}
    stiffness = next(p for p in found.effects[0].parameters if p.name == "stiffness")
    # These waves end below the resonance: they know the stiffness within a twentieth, and it comes out within that.
    assert stiffness.std < 0.05 * K
    assert abs(stiffness.value - K) < 2.0 * stiffness.std
    # The record begins in motion: where the spring stood then is not fitted, and its decay goes into the damping.
    assert values["damping"] == pytest.approx(8.0, rel=0.3)
    assert found.gap["axis_deflection.position"].after < 0.1 * found.gap["axis_deflection.position"].before
    assert logged_swing(problem, slide(), "axis") == pytest.approx((K / L, 8.0 / L), rel=1e-2)
    # What was split off is worked out and compared, never taken from the log.
    again = InverseDynamicsProblem(found.model, [record])
    assert again.motions[0].joints == ("axis",)


def test_a_file_may_map_a_deflection_that_the_model_lacks() -> None:
    table = '\n[channels]\n"axis_deflection.position" = { column = "gauge", unit = "mm" }\n'
    assert Model.from_toml(SLIDE + table).channel_table["axis_deflection.position"].column == "gauge"
    with pytest.raises(ModelError, match="is no channel of the model"):
        Model.from_toml(SLIDE + table.replace("axis_deflection", "axis_reflection"))


def test_a_sensor_of_a_deflection_goes_with_its_spring() -> None:
    content = slide().with_effect("joint_compliance", at="axis", **SPLITS["joint_compliance"]).to_dict()
    content["sensors"] = {"scale": {"measures": "axis_deflection.position"}, "encoder": {"measures": "axis.position"}}
    read = Model.from_dict(content).with_effect("sensor_offset", at="scale", value=1e-6)
    stiff = read.without_effect("joint_compliance", at="axis")
    assert (stiff.sensors, stiff.effects) == (("encoder",), ())
