"""The studies of appendix B: their elements by closed forms, their contact by Hertz, their figures and refusals."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from command_line import vpm as command

pytest.importorskip("skfem", reason="scikit-fem is not installed (pip install 'vpm-dynamics[fem]')")

from study_solids import curved_bar
from vpm.errors import MissingExtraError, VpmError
from vpm.studies import run_study
from vpm.studies.carton import LEVER, carton, crease_stiffness, fold
from vpm.studies.crease import Damage, elastica
from vpm.studies.finger_body import block, hertz, layer_factor
from vpm.studies.fingertip import FINGER, classes, indent
from vpm.studies.knee import LOADS, Load, Stressed, loaded, pictures
from vpm.studies.material import Material
from vpm.studies.press import Pressed, press
from vpm.studies.soft import SoftBody
from vpm.studies.solid import Solid, brick, von_mises
from vpm.studies.study import Compared, Study, Table
from vpm.studies.yoke import Yoke

RUBBER = Material({(1, 0): 9e3, (0, 1): 3e3, (1, 1): 20e3})


def test_energy_has_its_own_derivatives() -> None:
    rng = np.random.default_rng(1)
    strain = np.array([1.1, 0.2, -0.1, 0.9, 1.05])[:, None] + 0.05 * rng.normal(size=(5, 4))
    found, step = RUBBER.isochoric(strain), 1e-5
    for k in range(5):
        change = np.zeros((5, 1))
        change[k] = step
        ahead, behind = RUBBER.isochoric(strain + change), RUBBER.isochoric(strain - change)
        slope = (ahead.value - behind.value) / (2.0 * step)
        bend = (ahead.gradient - behind.gradient) / (2.0 * step)
        np.testing.assert_allclose(found.gradient[k], slope, rtol=1e-6, atol=1e-3)
        np.testing.assert_allclose(found.hessian[k], bend, rtol=1e-6, atol=1e-2)


def slopes(first: float, second: float) -> tuple[float, float]:
    """Slopes ``dW/dI1`` and ``dW/dI2`` of rubber at constant volume, Pa, by its energy."""
    x, y = first - 3.0, second - 3.0
    terms = RUBBER.constants.items()
    w1 = sum(c * i * x ** max(i - 1, 0) * y**j for (i, j), c in terms)
    return w1, sum(c * j * x**i * y ** max(j - 1, 0) for (i, j), c in terms)


def uniaxial(stretch: float) -> float:
    """Nominal stress of rubber along one axis, Pa: ``2 (l - 1/l^2) (W_1 + W_2/l)``, R. S. Rivlin 1948."""
    w1, w2 = slopes(stretch**2 + 2.0 / stretch, 2.0 * stretch + stretch**-2)
    return 2.0 * (stretch - stretch**-2) * (w1 + w2 / stretch)


def equibiaxial(stretch: float) -> float:
    """Nominal stress of rubber along two axes alike, Pa: ``2 (l - 1/l^5) (W_1 + l^2 W_2)``."""
    w1, w2 = slopes(2.0 * stretch**2 + stretch**-4, stretch**4 + 2.0 * stretch**-2)
    return 2.0 * (stretch - stretch**-5) * (w1 + stretch**2 * w2)


@pytest.mark.parametrize("stretch", [0.6, 0.9, 1.4])
def test_pressed_cylinder_is_uniaxial(stretch: float) -> None:
    """Between smooth plates a cylinder stays one: the patch test at large strain, against Rivlin's closed form."""
    strain = np.array([stretch**-0.5, 0.0, 0.0, stretch, stretch**-0.5])[:, None]
    stress = RUBBER.isochoric(strain).gradient[:, 0]
    pressure = stress[0] * stretch**-0.5  # the side is free: P_rr + p dJ/da = 0
    nominal = stress[3] - pressure / stretch
    assert nominal == pytest.approx(uniaxial(stretch), rel=1e-9)
    inverse = stretch**-2.0
    strain = np.array([stretch, 0.0, 0.0, inverse, stretch])[:, None]
    stress = RUBBER.isochoric(strain).gradient[:, 0]
    # Radial and hoop stress alike, faces free.
    assert stress[0] - stress[3] * inverse / stretch == pytest.approx(equibiaxial(stretch), rel=1e-9)


def slipping_cylinder(way: float) -> tuple[Pressed, float, float, NDArray[np.float64]]:
    """A cylinder whose top is held along the axis alone, pressed from below; its force by the closed form."""
    radius = height = 1e-2
    body = block(height, radius / 3.0, RUBBER, 1)
    body.fixed = np.unique(np.concatenate([body.basis.get_dofs(body.held).all("u^2"), axis_dofs(body)]))
    body = wholly_touched(body)
    seen = press(body, [0.5 * way, way], start=0.0)[-1]
    outer = 3.0 * height
    stretch = 1.0 - way / height
    force = -uniaxial(stretch) * np.pi * outer**2
    rest = np.sort(np.asarray(body.skin.global_coordinates()[0]).mean(axis=1))
    return seen, force, stretch, rest


def axis_dofs(body: SoftBody) -> NDArray[np.int64]:
    on = body.mesh.facets_satisfying(lambda x: np.abs(x[0]) < 1e-9, boundaries_only=True)
    return np.asarray(body.basis.get_dofs(on).all("u^1"))


def wholly_touched(body: SoftBody) -> SoftBody:
    """The same body, with all of its lower face ready to touch."""
    below = body.mesh.facets_satisfying(lambda x: np.abs(x[1]) < 1e-12, boundaries_only=True)
    whole = replace(body, contact=below)
    whole.fixed = body.fixed
    return whole


def test_elements_pass_the_patch_test_at_large_strain() -> None:
    seen, force, stretch, rest = slipping_cylinder(2e-3)
    assert seen.force == pytest.approx(force, rel=1e-4)
    np.testing.assert_allclose(seen.radius, rest * stretch**-0.5, rtol=1e-4)
    true = force / (np.pi * (3e-2) ** 2) * stretch
    np.testing.assert_allclose(seen.pressure, true, rtol=1e-3)


@pytest.mark.nightly
def test_ball_on_a_layer_is_that_of_hertz_and_dimitriadis() -> None:
    height, radius, share = 1e-2, 5e-2, 0.1
    way = (share * height) ** 2 / radius
    body = block(height, 1.3 * share * height, FINGER.tissue, 2)
    seen = press(body, [way], start=0.0, curvature=-1.0 / radius)[-1]
    force, edge = hertz(way, radius, FINGER.tissue.young)
    assert seen.force / force == pytest.approx(float(layer_factor(share)), rel=5e-3)
    assert seen.contact_radius == pytest.approx(float(edge), rel=0.05)
    assert seen.overlap < 1e-4 * way


def test_finger_keeps_its_energy_and_classes_cover_the_contact() -> None:
    curve = indent(FINGER.with_(held=False), 1, np.array([0.3, 0.6, 1.0]))
    assert abs(curve.balance()) < 5e-3
    last = curve.steps[-1]
    assert np.all(np.diff([step.force for step in curve.steps]) > 0.0)
    # Pressures over their shadow bear the force.
    borne = np.trapezoid(2.0 * np.pi * last.radius * last.pressure, last.radius)
    assert borne == pytest.approx(last.force, rel=0.15)
    assert 0.5e6 * last.area < float(classes(last).sum()) <= 1e6 * last.area * (1.0 + 1e-9)


def test_curved_bar_converges_with_the_second_order() -> None:
    errors = [curved_bar(n)[1] for n in (1, 2)]
    assert errors[1] < 0.02
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)


def test_cantilever_bends_as_timoshenko_says() -> None:
    length, side, young, load = 1.0, 0.1, 2e11, 1000.0
    mesh = brick(np.linspace(0.0, length, 9), np.linspace(0.0, side, 2), np.linspace(0.0, side, 2))
    solid = Solid(mesh, young, 0.0)
    ends = [
        mesh.facets_satisfying(lambda x, at=at: np.abs(x[0] - at) < 1e-9, boundaries_only=True) for at in (0.0, length)
    ]
    force = solid.load(ends[1], lambda x: np.stack([0.0 * x[0], 0.0 * x[0], 0.0 * x[0] - load / side**2]))
    (moved,) = solid.solve(solid.basis.get_dofs(ends[0]).all(), force)
    moment = side**4 / 12.0
    tip = load * length**3 / (3.0 * young * moment) + load * length / (5.0 / 6.0 * 0.5 * young * side**2)
    assert -moved[solid.basis.nodal_dofs[2]].min() == pytest.approx(tip, rel=5e-3)


@pytest.fixture(scope="module")
def frame() -> dict[str, Stressed]:
    return loaded(Yoke(), 1, LOADS | {"other side": Load(1250.0, 0.050, 0.052)}, 192e9)


def test_frame_is_in_balance_and_symmetric(frame: dict[str, Stressed]) -> None:
    seen, axial = frame, frame["axial, as tested"]
    assert axial.support == pytest.approx(1250.0, rel=1e-9)
    assert seen["line I, heel"].peak == pytest.approx(seen["other side"].peak, rel=1e-6)
    softer = loaded(Yoke(), 1, {"axial": LOADS["axial, as tested"]}, 11.7e9)["axial"]
    assert softer.peak == pytest.approx(axial.peak, rel=1e-6)
    assert softer.deflection == pytest.approx(axial.deflection * 192.0 / 11.7, rel=1e-6)


def test_von_mises_of_known_stresses() -> None:
    stress = np.zeros((3, 3, 3))
    stress[0, 0, 0] = 5.0  # tension
    stress[0, 1, 1] = stress[1, 0, 1] = 2.0  # shear
    stress[:, :, 2] = 7.0 * np.eye(3)  # pressure
    np.testing.assert_allclose(von_mises(stress), [5.0, 2.0 * np.sqrt(3.0), 0.0], atol=1e-12)


def test_flexible_panel_is_an_elastica_below_the_rigid_one() -> None:
    flexible = fold(carton(level="elements(3)"))
    for degrees in (20.0, 60.0, 85.0):
        angle = np.radians(degrees)
        assert flexible.at(angle) == pytest.approx(elastica(angle, crease_stiffness(), LEVER, carton()), rel=5e-3)
        assert flexible.at(angle) < crease_stiffness() * angle / LEVER


def test_damage_of_a_fold_by_its_integral() -> None:
    damage, stiffness, angle = Damage(0.3, 0.4), 0.05, 1.2
    q = np.linspace(0.0, angle, 20_001)
    torque = stiffness * q * (1.0 - damage.share * (1.0 - np.exp(-q / damage.scale)))
    kept = 0.5 * stiffness * (1.0 - damage.at(angle)) * angle**2
    assert damage.lost(stiffness, angle) == pytest.approx(np.trapezoid(torque, q) - kept, rel=1e-6)


@pytest.mark.parametrize(
    ("doing", "words"),
    [
        (lambda: run_study("elbow"), 'there is no study "elbow"'),
        (lambda: run_study("knee", -1), "cannot be made"),
        (lambda: run_study("knee", 7), "take 1 to 6"),
        (lambda: run_study("fingertip", 13), "from 1 to 12"),
        (lambda: run_study("carton", 17), "from 1 to 16"),
        (lambda: FINGER.with_(radius=4e-3).body(1), "leave no tissue"),
        (lambda: Yoke(corner=0.05), "has no room"),
        (lambda: Damage(1.0, 0.1), "cannot lose the share"),
        (lambda: Material({(1, 1): 1.0}), "shear modulus"),
    ],
)
def test_what_cannot_be_is_one_sentence(doing: Callable[[], object], words: str) -> None:
    with pytest.raises(VpmError, match=words) as caught:
        doing()
    assert "\n" not in str(caught.value)


def test_pressing_beyond_the_bone_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vpm.studies.press.CUTS", 0)
    monkeypatch.setattr("vpm.studies.press.STEPS", 6)
    with pytest.raises(VpmError, match="no balance was found beyond an indentation of 0 mm"):
        press(FINGER.body(1), [6e-3], start=-FINGER.radius)


def test_study_writes_its_files(frame: dict[str, Stressed], tmp_path: Path) -> None:
    shown = pictures(Yoke(), [frame])[:1]
    compared = (Compared("force", 2.0, 1.6, "N", "Fig. 1"), Compared("stress", 3.0, None, "MPa", "none"))
    tables = (Table("Sizes", ("a",), ((1.0,),)),)
    study = Study("knee", "A <frame>", compared, tables, ("its size",), shown)
    assert compared[0].difference == pytest.approx(25.0)
    names = {path.name for path in study.save(tmp_path / "found")}
    assert names == {"study.json", "report.html", "stress_1.png"}
    written = json.loads((tmp_path / "found" / "study.json").read_text(encoding="utf-8"))
    assert written == study.to_dict()
    assert written["compared"][1]["printed"] is None
    page = (tmp_path / "found" / "report.html").read_text(encoding="utf-8")
    assert page.count("<svg") == len(study.pictures)
    assert "A &lt;frame&gt;" in page
    assert "25" in str(study)


def test_command_refuses_in_one_sentence() -> None:
    done = command("study", "kneee", "-q")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == 'error: there is no study "kneee"; did you mean "knee"?'


def test_missing_library_is_told_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "skfem", None)
    with pytest.raises(MissingExtraError, match=r"vpm-dynamics\[fem\]"):
        run_study("fingertip", 1)
    assert carton(level="rigid").joints == ("fold", "crease")  # needs no elements


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["knee", "fingertip", "carton"])
def test_whole_studies_run_and_converge(name: str) -> None:
    found = run_study(name, 2)
    assert found.compared
    (table,) = [each for each in found.tables if each.title.startswith("Convergence") and "stiffness" not in each.title]
    for row in table.rows:
        assert all(isinstance(cell, str) or (cell is not None and np.isfinite(cell)) for cell in row)


@pytest.mark.nightly
def test_forces_converge_with_the_mesh() -> None:
    forces = np.array([indent(FINGER.with_(held=False), n).force(np.array([1.0, 2.0, 3.0])) for n in (1, 2, 3)])
    steps = np.abs(np.diff(forces, axis=0)) / forces[-1]
    assert np.all(steps[0] < 0.02)
    assert np.all(steps[1] < 0.01)
