"""Links whose sections change, of layers, and curved at rest, from model files."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import vpm
from places import EXAMPLES
from vpm.errors import ModelError
from vpm.simplify.reductions import reductions

EXAMPLE = EXAMPLES / "curved_arm" / "model.toml"
CURVED = ("strain(5)", "bezier(6)", "elements(16)", "lumped(40)")
#: EJx = 2, mass 0.5 kg/m.
NUMBERS = {"bending_x": 2.0, "bending_y": 8.0, "torsion": 3.0, "extension": 1e6, "mass": 0.5}
FACE = {"thickness": 0.5e-3, "young": 60e9, "poisson": 0.1, "density": 1500.0}
CORE = {"thickness": 10e-3, "young": 70e6, "poisson": 0.25, "density": 80.0}


def stiffness(**changes: float) -> dict[str, Any]:
    return {"shape": "stiffness", **NUMBERS, **changes}


def link(**beam: Any) -> dict[str, Any]:
    """A link of 1 m on the world, along x, its y upward, under weight."""
    table = {"parent": "world", "rotation": [np.pi / 2, 0.0, np.pi / 2], "length": 1.0, "level": "strain(5)"}
    table |= {"deforms": ["bending_x"], "section": stiffness(), **beam}
    return {
        "name": "link",
        "gravity": [0.0, 0.0, -9.81],
        "beams": {"link": {key: value for key, value in table.items() if value is not None}},
        "markers": {"tip": {"parent": "link"}},
    }


def built(**beam: Any) -> vpm.Model:
    return vpm.Model.from_dict(link(**beam))


def tip(model: vpm.Model, q: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    n = len(model.coordinates)
    simulation = vpm.Simulation(model, 1e-3, state=np.concatenate([np.zeros(n) if q is None else q, np.zeros(n)]))
    return np.array([simulation[f"tip.{axis}"] for axis in "xyz"])


def hanging(model: vpm.Model) -> NDArray[np.float64]:
    """Place of the tip in equilibrium less that of the unloaded link."""
    return tip(model, model.equilibrium([])[0]) - tip(model)


@pytest.mark.parametrize("level", ["strain(5)", "bezier(5)", "modal(3)", "deflection(5)", "hermite(4)", "elements(12)"])
def test_moduli_stand_in_for_a_shape(level: str) -> None:
    model = vpm.Model.from_dict(link(level=level) | {"gravity": [0.0, 0.0, 0.0]})
    first = 1.8751040687**2 * np.sqrt(NUMBERS["bending_x"] / NUMBERS["mass"]) / (2.0 * np.pi)
    assert model.natural_frequencies(np.zeros(0))[0] == pytest.approx(first, rel=3e-3)
    assert model.parameters["link.section.bending_x"].unit == "N m^2"
    other = model.with_parameters({"link.section.bending_x": 8.0})
    assert other.natural_frequencies(np.zeros(0))[0] == pytest.approx(2.0 * first, rel=3e-3)


def test_tables_change_along_the_link() -> None:
    # EJ from 2 to 1: v = F int (1 - s)^2 / (2 - s) ds = F (ln 2 - 1/2), here of a load at the tip.
    sections = [{"at": 0.0, **stiffness(mass=1e-9)}, {"at": 1.0, **stiffness(bending_x=1.0, mass=1e-9)}]
    content = link(section=None, sections=sections)
    content |= {"bodies": {"load": {"mass": 1e-3}}}
    content |= {"joints": {"grip": {"type": "fixed", "parent": "link", "child": "load"}}}
    moved = hanging(vpm.Model.from_dict(content))
    assert moved[2] == pytest.approx(-9.81e-3 * (np.log(2.0) - 0.5), rel=1e-5)


def test_a_sandwich_sags_by_bending_and_by_its_core() -> None:
    layers = {"shape": "layers", "width": 0.04, "layers": [FACE, CORE, FACE]}
    model = built(section=layers, deforms=["bending_x", "shear_y"])
    load = 0.04 * (2.0 * 0.5e-3 * 1500.0 + 10e-3 * 80.0) * 9.81
    bending = 0.04 * (60e9 * (11e-3**3 - 10e-3**3) + 70e6 * 10e-3**3) / 12.0
    # Faces carry no shear worth speaking of: GA = G b d^2 / c, Allen 1969, d between their middles.
    shear = 70e6 / 2.5 * 0.04 * 10.5e-3**2 / 10e-3
    assert hanging(model)[2] == pytest.approx(-load * (1.0 / (8.0 * bending) + 0.5 / shear), rel=2e-3)
    core = model.parameters["link.section.layers.1.young"]
    assert (core.value, core.unit) == (70e6, "Pa")


@pytest.mark.parametrize("level", CURVED)
def test_a_quarter_circle_under_its_load(level: str) -> None:
    # Castigliano: a force across the root at the tip of a quarter circle moves it by (3 pi / 4 - 2) F R^3 / EJ along
    # itself, and by F R^3 / (2 EJ) along the root: int cos (1 - sin).
    content = link(level=level, length=np.pi / 2, rest={"bending_x": 1.0}, section=stiffness(mass=1e-9))
    content |= {"bodies": {"load": {"mass": 1e-4}}}
    content |= {"joints": {"grip": {"type": "fixed", "parent": "link", "child": "load"}}}
    model = vpm.Model.from_dict(content)
    np.testing.assert_allclose(tip(model), [1.0, 0.0, -1.0], atol=1e-9)
    force = 9.81e-4 / NUMBERS["bending_x"]
    along, down = -0.5 * force, -(0.75 * np.pi - 2.0) * force
    np.testing.assert_allclose(hanging(model), [along, 0.0, down], rtol=1e-2, atol=1e-9)


@pytest.mark.parametrize("level", ["strain(5)", "elements(16)", "bezier(6)"])
def test_the_bend_of_bathe_and_bolourchi(level: str) -> None:
    # 45 degrees of R = 100, section 1 x 1, E = 1e7, 600 across its plane: the tip moves from (29.3, 70.7, 0) to (15.9,
    # 47.2, 53.4) by Bathe and Bolourchi 1979, (15.79, 47.23, 53.37) by Simo and Vu-Quoc 1986, (15.7, 47.0, 53.5) by
    # Cardona and Geradin 1988. They twist with the polar moment; Saint-Venant's 0.1406 ends at (15.6, 46.9, 53.6).
    moduli = {"bending_x": 1e7 / 12.0, "bending_y": 1e7 / 12.0, "torsion": 5e6 / 6.0, "extension": 1e7, "mass": 1e-9}
    content = link(
        level=level,
        length=25.0 * np.pi,
        rotation=[0.0, 0.0, 0.0],
        deforms=["bending_x", "bending_y", "torsion"],
        section={"shape": "stiffness", **moduli},
        rest={"bending_x": -0.01},
    )
    content |= {"bodies": {"load": {"mass": 1.0}}, "gravity": [600.0, 0.0, 0.0]}
    content |= {"joints": {"grip": {"type": "fixed", "parent": "link", "child": "load"}}}
    model = vpm.Model.from_dict(content)
    np.testing.assert_allclose(tip(model), [0.0, 29.29, 70.71], atol=0.01)
    up, side, along = tip(model, model.equilibrium([])[0])
    assert 15.65 < side < 15.95
    assert 46.95 < along < 47.25
    assert 53.35 < up < 53.55


@pytest.mark.parametrize("level", ["strain(2)", "elements(2)", "bezier(3)", "lumped(3)", "rigid"])
def test_a_curved_arm_keeps_its_energy(level: str) -> None:
    content = vpm.Model.load(EXAMPLE).to_dict()
    content["beams"]["link"].pop("damping")
    content["beams"]["link"]["deforms"] = ["bending_x", "torsion"]
    model = vpm.Model.from_dict(content).at(level)
    n = len(model.coordinates)
    start = np.zeros(2 * n)
    start[n] = 1.0
    simulation = vpm.Simulation(model, 0.01, integrator="rk4", substeps=200, state=start)
    first = sum(model.energy(start[:n], start[n:]))
    for _ in range(10):
        simulation.step([0.0])
    q, v = simulation.state[:n], simulation.state[n:]
    assert abs(sum(model.energy(q, v)) - first) < 1e-6 * model.energy(q, v)[0]


def test_inverse_dynamics_and_linear_models_know_the_curve() -> None:
    content, random = vpm.Model.load(EXAMPLE).to_dict(), np.random.default_rng(3)
    # Shear through the core is a thousand times as stiff, and difference quotients would drown in its rounding.
    content["beams"]["link"]["deforms"] = ["bending_x", "bending_y", "torsion"]
    model = vpm.Model.from_dict(content)
    n = len(model.coordinates)
    q, v, effort = 0.02 * random.standard_normal((3, n))
    acceleration = model.forward_dynamics(q, v, effort)
    np.testing.assert_allclose(model.inverse_dynamics(q, v, acceleration), effort, atol=1e-9)
    state = np.concatenate([q, v])
    linear = model.linearize(state, [0.3])

    def rates(x: NDArray[np.float64]) -> NDArray[np.float64]:
        damped = np.zeros(n)
        damped[0] = 0.3
        return np.concatenate([x[n:], model.forward_dynamics(x[:n], x[n:], damped)])

    quotient = np.transpose([(rates(state + d) - rates(state - d)) / 2e-6 for d in 1e-6 * np.eye(2 * n)])
    np.testing.assert_allclose(linear.A, quotient, atol=1e-6 * np.abs(quotient).max())


def test_gauges_know_the_load_and_not_the_curve() -> None:
    model = vpm.Model.load(EXAMPLE)
    n = len(model.coordinates)
    assert vpm.Simulation(model, 1e-3, state=np.zeros(2 * n))["root.strain"] == 0.0
    strained = vpm.Simulation(model, 1e-3, state=np.concatenate([model.equilibrium([0.0])[0], np.zeros(n)]))
    assert strained["root.strain"] > 1e-4


def test_files_and_simpler_models_keep_what_a_link_is() -> None:
    model = vpm.Model.load(EXAMPLE)
    assert vpm.Model.from_toml(model.to_toml()) == model
    changes = [change for several in reductions(model).values() for change in several]
    names = {change.name for change in changes if change.kind == "level"}
    assert names == {"bezier(3)", "bezier(2)", "lumped(1)", "lumped(2)", "rigid"}
    assert "second-order" not in {change.name for change in changes}


def test_a_stiffness_of_the_tip_asks_for_one_material() -> None:
    model = vpm.Model.load(EXAMPLE).at("rigid")
    with pytest.raises(ModelError, match="whose sections are not all of its material"):
        model.with_effect("link_flexibility", "link", stiffness=1e3)


@pytest.mark.parametrize(
    ("beam", "sentence"),
    [
        ({"level": "modal(2)", "rest": {"bending_x": 1.0}}, 'the level "modal(2)" interpolates a deflection'),
        ({"second_order": False, "rest": {"bending_x": 1.0}}, "second_order = false"),
        ({"rest": {"bending_x": 1.0}, "rests": [{"at": 0.0}, {"at": 1.0}]}, "has rest and rests"),
        ({"rests": [{"at": 0.0}, {"at": 0.5}]}, "rise from 0 to the length 1 m"),
        ({"rests": [{"at": 0.0}, {}]}, "is missing; add the arc length"),
        ({"rests": [{"at": 0.0}]}, "has one entry"),
        ({"rest": {"bending_x": 1.0, "at": 0.5}}, "rest holds for the whole beam"),
        ({"rest": {"bending": 1.0}}, "is not a known key"),
        ({"deforms": ["shear_y"]}, "is missing, but the beam deforms in shear_y"),
        ({"material": FACE | {"thickness": None}}, "is of no use"),
        ({"section": {"shape": "circle", "diameter": 0.01}}, "link.material is missing"),
        ({"section": stiffness(mass=0.0)}, "mass"),
        ({"section": {"shape": "layers", "width": 0.01, "layers": []}}, "layers"),
        (
            {"section": {"shape": "layers", "width": 0.01, "layers": [FACE], "material": FACE | {"thickness": None}}},
            "is of no use to the shape layers",
        ),
        (
            {
                "section": None,
                "sections": [
                    {"at": 0.0, "shape": "layers", "width": 0.01, "layers": [FACE]},
                    {"at": 1.0, "shape": "layers", "width": 0.01, "layers": [FACE, CORE]},
                ],
            },
            "in some entries only",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(beam: dict[str, Any], sentence: str) -> None:
    if beam.get("material"):
        beam = {**beam, "material": {key: value for key, value in beam["material"].items() if value is not None}}
    if (beam.get("section") or {}).get("material"):
        material = {key: value for key, value in beam["section"]["material"].items() if value is not None}
        beam = {**beam, "section": {**beam["section"], "material": material}}
    with pytest.raises(ModelError) as caught:
        built(**beam)
    assert sentence in str(caught.value)
