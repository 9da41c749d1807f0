"""Contacts, bushings, load cells and free joints from model files, against closed forms and through every door."""

import json
import math

import numpy as np
import pytest

import vpm
from model_texts import changed, sliding
from vpm.errors import ModelError, SimulationError
from vpm.model import Model

G = 9.81

BLOCK = f"""
name = "block"
gravity = [0.0, 0.0, -9.81]
{sliding("carriage", "0.5", "x", "world")}{sliding("block", "2.0", "z", "carriage", "[0.0, 0.0, 1.0]")}
[contacts.foot]
parent = "block"
point = [0.0, 0.0, -0.1]
plane = {{ point = [0.0, 0.0, -0.1], normal = [0.0, 0.0, 2.0] }}
stiffness = {{ value = 2855, unit = "N/mm^1.1" }}
exponent = 1.1
damping = {{ value = 1, unit = "N s/mm" }}
damping_depth = {{ value = 0.1, unit = "mm" }}
friction = {{ static = 0.7, static_velocity = 0.1, dynamic = 0.55, dynamic_velocity = {{ value = 1, unit = "m/s" }} }}

[load_cells.cell]
joint = "z"

[sensors.scale]
measures = "foot.normal_force"
"""

FLOATING = """
name = "engine"
gravity = [0.0, 0.0, -9.81]

[bodies.engine]
mass = 30.0
inertia = [0.5, 0.6, 0.7, 0.0, 0.0, 0.0]

[joints.engine_joint]
type = "free"
parent = "world"
child = "engine"

[bushings.mount]
a = { parent = "engine" }
b = { parent = "world" }
stiffness = [50.0, 60.0, 70.0, 2e4, 3e4, { value = 40, unit = "N/mm" }]
damping = [0.5, 0.6, 0.7, 20, 30, 40]
"""


@pytest.fixture(scope="module")
def block() -> Model:
    return Model.from_toml(BLOCK)


@pytest.fixture(scope="module")
def floating() -> Model:
    return Model.from_toml(FLOATING)


def test_names_units_and_values(block: Model) -> None:
    stiffness = block.parameters["foot.stiffness"]
    assert stiffness.value == pytest.approx(2855.0 * 1000.0**1.1, rel=1e-14)
    assert stiffness.unit == "N/m^1.1"
    names = [name for name in block.parameter_names if name.startswith("foot.")]
    assert names == [
        *(f"foot.{key}" for key in ("stiffness", "exponent", "damping", "damping_depth")),
        *(f"foot.friction.{key}" for key in ("static", "static_velocity", "dynamic", "dynamic_velocity")),
    ]
    assert block.parameters["foot.damping"].value == 1000.0
    assert (block.contacts, block.bushings, block.load_cells) == (("foot",), (), ("cell",))
    ends = block.output_channels[-11:]
    assert ends[:5] == tuple(f"foot.{key}" for key in ("depth", "normal_force", "fx", "fy", "fz"))
    assert ends[5:] == tuple(f"cell.{key}" for key in ("mx", "my", "mz", "fx", "fy", "fz"))
    assert [block.channel_unit(name) for name in ends] == ["m", *["N"] * 4, *["N m"] * 3, *["N"] * 3]


def test_a_block_comes_to_rest_on_its_foot(block: Model) -> None:
    sim = vpm.Simulation(block, 1e-3, substeps=4, state={"z.position": 0.01, "x.velocity": 0.5})
    sim.run(np.zeros((3000, 0)))
    assert sim["foot.normal_force"] == pytest.approx(2.0 * G, rel=1e-6)
    assert sim["foot.depth"] == pytest.approx(
        (2.0 * G / block.parameters["foot.stiffness"].value) ** (1 / 1.1), rel=1e-6
    )
    assert sim["foot.fz"] == sim["foot.normal_force"]
    # Nothing but the foot carries the block, so its joint carries nothing along z; friction has stopped both bodies.
    assert sim["cell.fz"] == pytest.approx(0.0, abs=1e-9)
    assert abs(sim["x.velocity"]) < 0.02


def test_steps_of_controlled_error_meet_the_ground() -> None:
    """Without losses the block comes back to where it fell from, though a sample is longer than the impact."""
    smooth = changed(BLOCK, ("damping = { value = 1,", "damping = { value = 0,"), ("friction = {", "# friction = {"))
    height, energy = 0.05, 2.0 * G * 0.05
    sim = vpm.Simulation(smooth, 5e-3, integrator="adaptive(1e-8)", state={"z.position": height})
    run = sim.run(np.zeros((200, 0)))
    assert np.sum(run["foot.normal_force"] > 0.0) < 5  # hardly a sample sees the ground
    potential = 2.0 * G * run["z.position"] + 0.5 * 2.0 * run["z.velocity"] ** 2
    free = run["foot.depth"] < 0.0
    assert np.sum(np.diff(np.sign(run["z.velocity"])) > 0) >= 4  # bounces
    assert potential[free] == pytest.approx(np.full(np.sum(free), energy), rel=1e-5)


def test_an_open_contact_is_not_seen_and_a_closed_one_is(block: Model) -> None:
    vpm.Simulation(block, 1e-2, integrator="rk4", state={"z.position": 0.1})
    with pytest.raises(SimulationError, match=r"a step of .* is too large for rk4: the mode that moves `z` most"):
        vpm.Simulation(block, 1e-2, integrator="rk4", state={"z.position": -1e-3})


def test_the_file_reads_back(block: Model, floating: Model) -> None:
    for model in (block, floating, full()):
        again = Model.from_toml(model.to_toml())
        assert again == model
        assert again.to_toml() == model.to_toml()
        assert json.loads(again.description()) == json.loads(model.description())


def test_the_exponent_may_move_without_its_unit(block: Model) -> None:
    other = block.with_parameters({"foot.exponent": 1.3, "foot.friction.static": 0.9})
    assert other.parameters["foot.exponent"].value == 1.3
    assert other.parameters["foot.stiffness"].value == block.parameters["foot.stiffness"].value
    assert other.parameters["foot.stiffness"].unit == "N/m^1.3"
    assert other.parameters["foot.friction.static"].value == 0.9


def test_a_floating_body_rests_and_swings_on_its_bushing(floating: Model) -> None:
    assert floating.joints == tuple(f"engine_joint_{suffix}" for suffix in ("x", "y", "z", "rx", "ry", "rz"))
    kinds = ["prismatic"] * 3 + ["revolute"] * 3
    assert [floating.joint_kind(joint) for joint in floating.joints] == kinds
    sag = -30.0 * G / 4e4
    at_rest = {"engine_joint_z.position": sag}
    assert np.max(np.abs(rates(floating, at_rest))) < 1e-9
    linear = floating.linearize(at_rest)
    wanted = [math.sqrt(k / m) for k, m in zip((50, 60, 70, 2e4, 3e4, 4e4), (0.5, 0.6, 0.7, 30, 30, 30), strict=True)]
    assert np.sort(np.abs(np.linalg.eigvals(linear.A)))[::2] == pytest.approx(np.sort(wanted), rel=1e-9)
    assert vpm.Simulation(floating, 1e-3, state=at_rest)["mount.fz"] == pytest.approx(30.0 * G, rel=1e-12)


def rates(model: Model, state: dict[str, float]) -> np.ndarray:
    """Accelerations of a state without commands."""
    q, v = np.split(model.state(state), 2)
    return model.forward_dynamics(q, v, np.zeros(len(q)))


def full() -> Model:
    """The engine on a mount whose ways and angles are coupled."""
    k = np.diag([50.0, 60.0, 70.0, 2e4, 3e4, 4e4])
    k[0, 4] = k[4, 0] = 300.0
    c = np.diag([0.5, 0.6, 0.7, 20.0, 30.0, 40.0])
    c[1, 3], c[3, 1] = 1.0, -1.0
    text = FLOATING[: FLOATING.index("stiffness =")]
    return Model.from_toml(
        f"{text}stiffness = {k.tolist()}\ndamping = {c.tolist()}\npreload = [0, 0, 0, 0, 0, 294.3]\n"
    )


def test_full_matrices_and_a_preload() -> None:
    model = full()
    mount = json.loads(model.description())["bushings"][0]
    names = [name for name in model.parameter_names if name.startswith("mount.stiffness.")]
    assert len(names) == 21  # one for each pair of entries that have to be equal
    assert mount["stiffness"][0][4] == mount["stiffness"][4][0] == model.index("mount.stiffness.rx.y")
    assert model.parameters["mount.stiffness.rx.y"].unit == "N m/m"
    assert model.parameters["mount.stiffness.x"].unit == "N/m"
    assert model.parameters["mount.damping.ry.x"].value == -model.parameters["mount.damping.x.ry"].value == 1.0
    # The preload carries the weight, so it rests where it was put.
    assert np.max(np.abs(rates(model, {}))) < 1e-9
    stiffer = model.with_parameters({"mount.stiffness.rx.y": 250.0, "mount.preload.z": 300.0})
    assert stiffer.parameters["mount.stiffness.rx.y"].value == 250.0
    lower = [row[i] for i, row in enumerate(json.loads(stiffer.description())["bushings"][0]["stiffness"])]
    assert lower == mount_diagonal(stiffer)


def mount_diagonal(model: Model) -> list[int]:
    return [model.index(f"mount.stiffness.{name}") for name in ("rx", "ry", "rz", "x", "y", "z")]


def test_a_foot_on_a_flexible_link_and_a_bushing_to_it() -> None:
    text = """
    name = "arm"
    gravity = [0.0, 0.0, -9.81]
    [bodies.hub]
    mass = 1.0
    inertia = [0.1, 0.1, 0.1, 0, 0, 0]
    [joints.hinge]
    type = "revolute"
    parent = "world"
    child = "hub"
    axis = [0.0, 1.0, 0.0]
    [beams.link]
    parent = "hub"
    rotation = [0.0, 1.5707963267948966, 0.0]
    length = 0.8
    level = "bezier(3)"
    material = { young = 70e9, density = 2700 }
    section = { shape = "rectangle", width = 0.02, height = 0.02 }
    damping = { stiffness = 1e-4 }
    [contacts.tip]
    parent = "link"
    plane = { point = [0, 0, -0.05], normal = [0, 0, 1] }
    stiffness = 1e6
    damping = 300
    [bushings.stay]
    a = { parent = "link", at = 0.4, rotation = [0.0, -1.5707963267948966, 0.0] }
    b = { parent = "world", point = [0.4, 0.0, 0.0] }
    stiffness = [0, 0, 0, 0, 0, 100]
    [load_cells.cell]
    joint = "hinge"
    """
    model = Model.from_toml(text)
    sim = vpm.Simulation(model, 1e-3, substeps=2)
    sim.run(np.zeros((9000, 0)))
    # At rest the forces balance: hub and link weigh on hinge, stay and tip.
    weight = (1.0 + 0.8 * 4e-4 * 2700) * G
    turn = sim["hinge.position"]
    carried = -math.sin(turn) * sim["cell.fx"] + math.cos(turn) * sim["cell.fz"]
    assert sim["tip.normal_force"] > 1.0
    stay = math.copysign(math.hypot(sim["stay.fx"], sim["stay.fz"]), sim["stay.fz"])  # upright in the world
    assert abs(stay) > 1.0
    assert sim["tip.normal_force"] + stay + carried == pytest.approx(weight, rel=1e-5)
    assert abs(sim["hinge.velocity"]) < 1e-4


@pytest.mark.parametrize(
    ("old", "new", "where", "message"),
    [
        ('parent = "block"', 'parent = "world"', "contacts.foot.parent", "does not move against the plane"),
        ('parent = "block"', 'parent = "blok"', "contacts.foot.parent", 'did you mean "block"'),
        ("normal = [0.0, 0.0, 2.0]", "normal = [0, 0, 0]", "contacts.foot.plane.normal", "is no direction"),
        ("normal = [0.0, 0.0, 2.0]", "normal = [0, 2]", "contacts.foot.plane.normal", "has 2 entries"),
        (", normal = [0.0, 0.0, 2.0]", "", "contacts.foot.plane.normal", "is missing; add it, for example normal"),
        ("N/mm^1.1", "N/mm^1.2", "contacts.foot.stiffness", 'write for example "N/mm^1.1"'),
        ("N/mm^1.1", "N/mm", "contacts.foot.stiffness", "with the exponent 1.1 it is a force per length"),
        ("value = 2855", "value = -1", "contacts.foot.stiffness", "pull the body in"),
        ("exponent = 1.1", "exponent = 0.0", "contacts.foot", "exponent"),
        ('value = 1, unit = "N s/mm"', 'value = -1, unit = "N s/mm"', "contacts.foot.damping", "feed energy"),
        ("static = 0.7", "static = -0.7", "contacts.foot.friction.static", "push along the motion"),
        ("static = 0.7, ", "", "contacts.foot.friction.static", "is missing; add it, for example static = 0.7"),
        ("static = 0.7", "statik = 0.7", "contacts.foot.friction.statik", 'did you mean "static"'),
        ('value = 1, unit = "m/s"', 'value = 0.05, unit = "m/s"', "contacts.foot.friction.dynamic_velocity", "above"),
        ('joint = "z"', 'joint = "zz"', "load_cells.cell.joint", "is no joint of the model"),
        ("foot.normal_force", "foot.normal", "sensors.scale.measures", "foot.normal_force"),
    ],
)
def test_what_a_contact_cannot_be(old: str, new: str, where: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        changed(BLOCK, (old, new))
    assert caught.value.where is not None
    assert caught.value.where.startswith(where)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "where", "message"),
    [
        ('b = { parent = "world" }', 'b = { parent = "engine" }', "bushings.mount", "never deforms"),
        ('b = { parent = "world" }', 'b = { parent = "word" }', "bushings.mount.b.parent", 'did you mean "world"'),
        ('b = { parent = "world" }', 'b = { paren = "world" }', "bushings.mount.b.paren", 'did you mean "parent"'),
        ("b = ", "c = ", "bushings.mount.c", "is not a known key"),
        ("[50.0, 60.0,", "[-50.0, 60.0,", "bushings.mount.stiffness[0]", "push away from its rest"),
        ("damping = [0.5,", "damping = [-0.5,", "bushings.mount.damping[0]", "feed energy"),
        ("[50.0, 60.0,", "[60.0,", "bushings.mount.stiffness", "has 5 entries"),
        ('"N/mm"', '"N"', "bushings.mount.stiffness[5]", "wrong unit"),
        ("[0.5, 0.6, 0.7, 20, 30, 40]", "[[1], 0.6, 0.7, 20, 30, 40]", "bushings.mount.damping", "six rows of six"),
        ('type = "free"', 'type = "free"\naxis = [1, 0, 0]', "joints.engine_joint.axis", "a free joint has no axis"),
        ('type = "free"', 'type = "fixed"', "joints", "fixed joints only"),
    ],
)
def test_what_a_bushing_cannot_be(old: str, new: str, where: str, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        changed(FLOATING, (old, new))
    assert caught.value.where is not None
    assert caught.value.where.startswith(where)
    assert message in str(caught.value)


def matrix(change: dict[tuple[int, int], float]) -> str:
    entries = np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    for place, value in change.items():
        entries[place] = value
    return str(entries.tolist())


@pytest.mark.parametrize(
    ("key", "change", "message"),
    [
        ("stiffness", {(0, 4): 0.5}, "has 0.5 in row rx, column y, but 0 in row y, column rx"),
        ("stiffness", {(0, 4): 2.0, (4, 0): 2.0}, "smallest eigenvalue is -1"),
        ("stiffness", {(0, 4): 0.1, (4, 0): 0.1, (4, 4): 0.0}, "couples y with other directions"),
        ("damping", {(0, 4): 3.0}, "smallest eigenvalue is -0.5"),
        ("stiffness", {(1, 1): -2.0}, "push away from its rest"),
    ],
)
def test_matrices_that_give_energy_away(key: str, change: dict[tuple[int, int], float], message: str) -> None:
    text = FLOATING[: FLOATING.index("stiffness =")]
    other = "damping" if key == "stiffness" else "stiffness"
    with pytest.raises(ModelError) as caught:
        Model.from_toml(f"{text}{key} = {matrix(change)}\n{other} = [1, 1, 1, 1, 1, 1]\n")
    assert caught.value.where is not None
    assert caught.value.where.startswith(f"bushings.mount.{key}")
    assert message in str(caught.value)


def test_a_load_cell_at_a_fixed_joint_says_what_to_do() -> None:
    text = BLOCK.replace('joint = "z"\n\n[sensors', 'joint = "weld"\n\n[sensors')
    text = text.replace(
        "[joints.z]",
        '[bodies.lid]\nmass = 1.0\n[joints.weld]\ntype = "fixed"\nparent = "block"\nchild = "lid"\n\n[joints.z]',
    )
    with pytest.raises(ModelError, match="makes one piece of its bodies"):
        Model.from_toml(text)
