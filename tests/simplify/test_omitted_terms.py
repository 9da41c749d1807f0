"""Terms left out part by part: what is missing by closed forms, in the file, in runs, in a search."""

from pathlib import Path

import numpy as np
import pytest

import vpm
from test_coriolis_terms import ARM, CENTER, FIRST, LENGTH, SECOND, coriolis, swing
from test_simplify_levels import ARM as FLEXIBLE
from vpm.errors import ModelError, ValidityWarning
from vpm.simplify import Reduction, reductions, simplify
from vpm.simplify.reductions import COUPLING_TERMS, VELOCITY_TERMS
from vpm.simplify.terms import deformation_share, effort_share, motions
from vpm.simulate import Setup

SECOND_ORDER = Reduction("terms", "second-order", "link")
COUPLING = SECOND * LENGTH * CENTER
Array = np.ndarray


@pytest.fixture(scope="module")
def arm() -> vpm.Model:
    return vpm.Model.from_toml(ARM)


@pytest.fixture(scope="module")
def link() -> vpm.Model:
    return vpm.Model.from_toml(FLEXIBLE)


def inertia(q: Array) -> Array:
    """Mass matrix of two links, Craig, Introduction to Robotics, section 6.7."""
    outer = 0.05 + SECOND * CENTER**2
    across = outer + COUPLING * np.cos(q[1])
    inner = 0.1 + FIRST * 0.25 + SECOND * LENGTH**2 + outer + 2.0 * COUPLING * np.cos(q[1])
    return np.array([[inner, across], [across, outer]])


def test_what_is_missing_of_one_body_is_its_closed_form(arm: vpm.Model) -> None:
    upper, lower = (Reduction("terms", "velocity", name).applied(arm) for name in ("upper", "lower"))
    random = np.random.default_rng(3)
    for _ in range(5):
        q, v, a = random.normal(size=(3, 2))
        full = arm.inverse_dynamics(q, v, a)
        # The upper link turns about an axis that stands still, so that all velocity terms are the lower one's.
        assert upper.inverse_dynamics(q, v, a) == pytest.approx(full, abs=1e-12)
        assert full - lower.inverse_dynamics(q, v, a) == pytest.approx(coriolis(q, v), abs=1e-12)
        assert lower.forward_dynamics(q, v, lower.inverse_dynamics(q, v, a)) == pytest.approx(a, rel=1e-10)


def test_what_is_missing_of_the_mass_matrix_is_the_coupling_of_the_closed_form(arm: vpm.Model) -> None:
    cut = COUPLING_TERMS.applied(arm)
    random = np.random.default_rng(4)
    for _ in range(5):
        q, v, a = random.normal(size=(3, 2))
        whole = inertia(q)
        assert arm.mass_matrix(q) == pytest.approx(whole, rel=1e-12)
        assert cut.mass_matrix(q) == pytest.approx(np.diag(np.diag(whole)), rel=1e-12)
        missing = arm.inverse_dynamics(q, v, a) - cut.inverse_dynamics(q, v, a)
        assert missing == pytest.approx(whole[0, 1] * a[::-1], rel=1e-10)
        assert cut.forward_dynamics(q, v, cut.inverse_dynamics(q, v, a)) == pytest.approx(a, rel=1e-10)


def test_the_balance_of_energy_fails_by_the_power_of_what_is_left_out(arm: vpm.Model) -> None:
    q, v, tau = np.array([0.3, 1.1]), np.array([2.0, -1.0]), np.array([3.0, -2.0])
    step = 1e-6
    for reduction in (Reduction("terms", "velocity", "lower"), COUPLING_TERMS):
        model = reduction.applied(arm)
        a = model.forward_dynamics(q, v, tau)
        # Energy is that of the machine, not of what is left of its equations.
        gained = [sum(arm.energy(q + side * step * v, v + side * step * a)) for side in (1.0, -1.0)]
        missing = arm.inverse_dynamics(q, v, a) - model.inverse_dynamics(q, v, a)
        power = (gained[0] - gained[1]) / (2.0 * step)
        assert abs(v @ missing) > 0.1
        assert power == pytest.approx(v @ tau + v @ missing, rel=1e-6)


def test_a_motion_gives_back_the_efforts_that_it_was_simulated_from() -> None:
    time = 1e-3 * np.arange(300)
    push = {"one.command": 60.0 * np.sin(9.0 * time), "two.command": 15.0 * np.cos(7.0 * time)}
    full = vpm.Model.from_toml(ARM.split("[controllers.first]")[0])
    for reduction in (Reduction("terms", "velocity", "lower"), COUPLING_TERMS):
        model = reduction.applied(full)
        record = vpm.Experiment.from_arrays(time, push, model=model)
        run = vpm.simulate(model, record, "free_run", integrator="rk4")
        channels = [f"{joint}.{kind}" for joint in model.joints for kind in ("position", "velocity", "acceleration")]
        moved = vpm.Experiment.from_arrays(time, {name: run[name] for name in channels}, model=model)
        back, other = (vpm.simulate(each, moved, "prescribed_motion") for each in (model, full))
        for joint in model.joints:
            expected = np.interp(back.time, run.time, run[f"{joint}.effort"])
            allowed = 0.02 * np.ptp(expected)
            assert back[f"{joint}.effort"] == pytest.approx(expected, abs=allowed)
            assert np.max(np.abs(other[f"{joint}.effort"] - expected)) > 2.0 * allowed


def test_the_file_says_what_is_left_out(arm: vpm.Model, link: vpm.Model, tmp_path: Path) -> None:
    for model, reduction, line in (
        (arm, Reduction("terms", "velocity", "lower"), "velocity_terms = false"),
        (arm, COUPLING_TERMS, "inertia_coupling = false"),
        (link, SECOND_ORDER, "second_order = false"),
        (link, Reduction("terms", "velocity", "link"), "velocity_terms = false"),
    ):
        changed = reduction.applied(model)
        assert changed.to_toml().count(line) == 1
        assert vpm.Model.load(changed.save(tmp_path / "model.toml")).to_dict() == changed.to_dict() != model.to_dict()
        assert reduction.site not in reductions(changed) or reduction not in reductions(changed)[reduction.site]


def test_parts_without_such_terms_are_refused() -> None:
    with pytest.raises(ModelError, match="inertia_coupling"):
        vpm.Model.from_toml(ARM.replace("translation = [0.8, 0.0, 0.0]", "inertia_coupling = 0"))
    fixed = ARM.replace('type = "revolute"\nparent = "upper"', 'type = "fixed"\nparent = "upper"')
    fixed = fixed.replace("axis = [0.0, 0.0, 1.0]\ntranslation = [0.8", "translation = [0.8").split("[actuators.two]")[
        0
    ]
    with pytest.raises(ModelError, match="a fixed joint has no acceleration of its own"):
        vpm.Model.from_toml(fixed.replace("translation", "inertia_coupling = false\ntranslation"))
    with pytest.raises(ModelError, match='lower is fixed to "upper"'):
        vpm.Model.from_toml(fixed.replace(f"mass = {SECOND}", f"mass = {SECOND}\nvelocity_terms = false"))


def test_shares_are_those_of_the_closed_forms(arm: vpm.Model) -> None:
    motion = [(np.array([[0.3, 1.1]]), np.array([[2.0, -1.0]]), np.array([[3.0, 1.0]]))]
    q, v, a = (each[0] for each in motion[0])
    whole = np.linalg.norm(coriolis(q, v)) + np.linalg.norm(inertia(q) @ a)
    lower = Reduction("terms", "velocity", "lower").applied(arm)
    assert effort_share(arm, lower, motion) == pytest.approx(np.linalg.norm(coriolis(q, v)) / whole)
    coupled = np.linalg.norm(inertia(q)[0, 1] * a)
    assert effort_share(arm, COUPLING_TERMS.applied(arm), motion) == pytest.approx(coupled / whole)


def test_a_search_cuts_the_coupling_where_the_motion_allows_it(arm: vpm.Model) -> None:
    told: list[str] = []
    ladder = simplify(arm, swing(arm, 0.02), rate=1000.0, tolerance=0.1, against="model", tell=told.append)
    shares = {
        sentence.split(" terms")[0]: float(sentence.split()[3]) / 100.0 for sentence in told if "take" in sentence
    }
    cut = [rung for rung in ladder.rungs if rung.removed == (str(COUPLING_TERMS),)]
    assert 0.0 < shares["velocity"] < shares["coupling"] <= 0.5
    assert cut
    strict = simplify(arm, swing(arm, 0.02), rate=1000.0, tolerance=1e-3, against="model")
    assert all(str(COUPLING_TERMS) not in rung.removed for rung in strict.rungs)


def test_second_order_of_a_link_is_weighed_by_its_share_of_the_deformation() -> None:
    link = vpm.Model.from_toml(FLEXIBLE.replace("value = 200.0", "value = 400.0"))
    time = 4e-3 * np.arange(120)
    shares, errors = [], []
    for size in (0.05, 0.1):
        reference = {"motor.reference": size * (1.0 - np.cos(5.0 * time))}
        record = vpm.Experiment.from_arrays(time, reference, model=link, name="swing")
        along = motions(link, [record], "closed_loop", Setup("linearly_implicit", 4))
        shares.append(deformation_share(link, "link", along))
        runs = [vpm.simulate(m, record, "closed_loop", substeps=4) for m in (link, SECOND_ORDER.applied(link))]
        strains = [run["root.strain"] for run in runs]
        errors.append(float(np.linalg.norm(strains[1] - strains[0]) / np.linalg.norm(strains[0])))
    # The loads along the link are weight and rotation; what they add to a deflection is a few thousandths of it.
    assert all(0.1 < error / share < 10.0 for error, share in zip(errors, shares, strict=True))
    assert max(errors) < 0.02


def test_a_link_to_first_order_is_warned_of_sooner() -> None:
    soft = vpm.Model.from_toml(FLEXIBLE.replace("value = 200.0", "value = 20.0"))
    time = 4e-3 * np.arange(100)
    record = vpm.Experiment.from_arrays(time, {"motor.reference": 0.5 * np.sin(6.0 * time)}, model=soft)
    assert vpm.simulate(soft, record, "closed_loop", substeps=4).notes == ()
    with pytest.warns(ValidityWarning, match=r"a deflection to first order is right within 1 % up to 0\.025 rad"):
        vpm.simulate(SECOND_ORDER.applied(soft), record, "closed_loop", substeps=4)


def test_the_places_are_listed_part_by_part(arm: vpm.Model, link: vpm.Model) -> None:
    sites = reductions(arm)
    assert [change.at for change in sites[VELOCITY_TERMS.site]] == ["upper", "lower", "the machine"]
    assert [change.at for change in sites[COUPLING_TERMS.site]] == ["the machine"]
    assert reductions(link)[SECOND_ORDER.site] == (SECOND_ORDER,)
    assert SECOND_ORDER.site not in reductions(link.at("lumped(2)"))
