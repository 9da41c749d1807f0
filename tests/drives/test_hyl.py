"""The HyL leg: the witness against published numbers, the package against both, and what its scenarios show."""

import runpy
import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import vpm
from hyl_laws import Ground
from hyl_witness import CASES, DESIRED, GRAVITY, LOWER, MASS, STIFF, TIMES, UPPER, Drive, Leg
from validation import hyl
from validation.row import accepted, values
from vpm import linkages
from vpm.linkages import Leg as Linkage

REFERENCE = accepted("hyl")


def close(name: str, found: object) -> None:
    """A reference value within its own tolerance."""
    entry = REFERENCE[name]
    tolerance = entry["tolerance"]
    np.testing.assert_allclose(
        np.ravel(np.asarray(found, dtype=float)),
        np.ravel(entry["value"]),
        rtol=tolerance.get("rel", 0.0),
        atol=tolerance.get("abs", 0.0),
    )


# ---- the witness itself ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("payload", [0, 3, 7])
def test_the_witness_stands_as_the_reference(payload: int) -> None:
    close(f"hyl.static_grf.payload{payload}", (MASS + payload) * GRAVITY)
    for gain in (150, 300):
        q, _ = Leg(payload=payload, proportional=gain).rest()
        height = UPPER * np.cos(q[0]) + LOWER * np.cos(q.sum())
        close(f"hyl.static_pose.P{gain}.payload{payload}", [*np.degrees(q), height])


@pytest.mark.nightly
def test_the_witness_falls_as_the_reference() -> None:
    close("hyl.contact.kc_SI", Ground().stiffness)
    close("hyl.contact.cc_SI", Ground().damping)
    times = np.concatenate([np.linspace(0.0, 0.1, 3), np.arange(1010, 1020) / 1e4, [0.15, 0.2, 0.3, 0.4]])
    peaks, heights = [], []
    for gain in (150.0, 300.0):
        leg = Leg(proportional=gain)
        seen = leg.observe(leg.simulate(times, 1e-6), times)
        peaks.append(seen["normal_force"].max())
        heights.append(seen["height"][-4:])
        lost = seen["impulse"][-1] - MASS * GRAVITY * times[-1] - seen["momentum"][-1]
        close("hyl.drop.impulse_balance", lost)
    close("hyl.drop.peak_grf", peaks)
    close("hyl.drop.hip_height", np.concatenate(heights))


@pytest.mark.nightly
@pytest.mark.parametrize("case", ["rigid, low gain", "hydraulic, low gain"])
def test_the_stored_values_are_those_of_an_implicit_method_too(case: str) -> None:
    """The first milliseconds after touch-down, by Radau's method instead of the explicit one that wrote the file."""
    times = TIMES[TIMES < 0.106]
    leg = replace(CASES[case], method="Radau")
    seen, stored = leg.observe(leg.simulate(times, 1e-7), times), values("hyl_witness")[case]
    for name, column in seen.items():
        expected = np.array(stored[name][: times.size])
        np.testing.assert_allclose(column, expected, rtol=0.0, atol=1e-6 * max(np.abs(expected).max(), 1e-9))


def test_forces_beside_soft_joints_take_energy_from_nowhere_and_torques_and_springs_do_not() -> None:
    """Why the controllers of the leg on bushings are sampled."""
    worst: dict[Drive, float] = {}
    drives: tuple[Drive, ...] = ("pistons", "torques", "springs")
    for drive in drives:
        poles = Leg(drive=drive, bushings=STIFF).poles()
        poles = poles[poles.imag > 1.0]  # those that oscillate
        damping = -poles.real / np.abs(poles)
        worst[drive] = damping.min()
        if drive == "pistons":
            frequency = abs(poles[damping.argmin()].imag) / (2.0 * np.pi)
            assert frequency == pytest.approx(4970.0, abs=10.0)
    assert worst["pistons"] == pytest.approx(-0.073, abs=0.001)
    assert min(worst["torques"], worst["springs"]) > 0.015


# ---- the package -----------------------------------------------------------------------------------------------------


def test_cylinders_carry_the_published_weights() -> None:
    """Forces of the cylinders at rest on a smooth floor, against the torques of the closed linkage by its levers."""
    leg = linkages.load(hyl.HYL.parent / "hyq_leg" / "leg.toml")
    assert isinstance(leg, Linkage)
    run = hyl.scenario("static.toml", [{"name": "stand", "model": "rcm.toml", "set": hyl.SMOOTH}], duration=6.0)[
        "stand"
    ]
    q = np.array([run[f"{joint}_rotation.position"][-1] for joint in ("hip", "knee")])
    expected = leg.cylinder_forces(q, 150.0 * (DESIRED - q))
    found = [run[f"{joint}_drive.force"][-1] for joint in ("hip", "knee")]
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    np.testing.assert_allclose(found, [-294.95, 734.53], atol=0.01)


def test_forces_of_the_cylinders_are_torques_of_the_joints() -> None:
    """Drives on the joints with a pd controller instead of ideal cylinders give the same drop."""
    text = (hyl.HYL / "rcm.toml").read_text(encoding="utf-8")
    for joint in ("hip", "knee"):
        text = text.replace(
            f'line = "{joint}_cylinder"\ngain = {{ value = 1.0, unit = "N/N" }}\ncommand_unit = "N"',
            f'joint = "{joint}_rotation"\ngain = {{ value = 1.0, unit = "N m" }}',
        )
    text = text.replace('type = "force_loop"', 'type = "pd"').replace("feed_forward = 1.0\nforce_gain = 0.0\n", "")
    torques = vpm.Model.from_toml(text)
    scenario = vpm.Scenario.load(hyl.HYL / "drop.toml")
    forces = scenario.models["rigid, low gain"]
    heights = [
        vpm.simulate(
            model,
            scenario.experiment(model),
            scenario.mode(model),
            initial_state=scenario.initial_state(model),
            integrator="adaptive",
        )["slider.position"]
        for model in (forces, torques)
    ]
    # Both are held for a sample, in which the lever changes.
    np.testing.assert_allclose(heights[0], heights[1], atol=2e-6)


def test_impulse_and_weight_balance_with_hydraulics() -> None:
    """Nothing inside the leg changes its vertical momentum."""
    run = hyl.drop("hydraulic.toml", {}, duration=0.3, time_step=5e-5)
    model = vpm.Model.load(hyl.HYL / "hydraulic.toml")
    assert abs(hyl.lost_impulse(model, run)) < 1e-3


def test_controllers_of_a_robot_change_the_drop_a_little() -> None:
    """At 1 kHz the peak is 3 % lower, since the damping hears of the impact late, and the hip within 0.6 mm."""
    text = (hyl.HYL / "rcm.toml").read_text(encoding="utf-8")
    sampled = vpm.Model.from_toml(text.replace("derivative = 6.0\n", "derivative = 6.0\nsample_time = 1e-3\n"))
    content = tomllib.loads((hyl.HYL / "drop.toml").read_text(encoding="utf-8")) | {"duration": 0.4, "time_step": 1e-5}
    scenario = vpm.Scenario.from_dict(content, folder=hyl.HYL)
    log, start = scenario.experiment(sampled), scenario.initial_state(sampled)
    run = vpm.simulate(sampled, log, scenario.mode(sampled), initial_state=start, integrator="adaptive")
    assert run["foot.normal_force"].max() == pytest.approx(1126.0, abs=1.0)
    heights = np.interp([0.15, 0.2, 0.3, 0.4], run.time, run["slider.position"])
    assert np.abs(heights - REFERENCE["hyl.drop.hip_height"]["value"][:4]).max() == pytest.approx(5.6e-4, abs=5e-5)


@pytest.mark.parametrize("name", ["static", "drop", "hydraulic_drop"])
def test_every_scenario_runs(name: str) -> None:
    result = vpm.Scenario.load(hyl.HYL / f"{name}.toml").run()
    assert result.failures == {}
    if name == "drop":
        peaks = [result[f"rigid, {gain} gain"]["foot.normal_force"].max() for gain in ("low", "high")]
        # Controllers that are held for 10 us hear of the impact late.
        np.testing.assert_allclose(peaks, REFERENCE["hyl.drop.peak_grf"]["value"], rtol=1.5e-3)
    for run in result.runs.values():
        assert np.isfinite(run["slider.position"]).all()
        assert run["foot.normal_force"].min() >= 0.0


def test_a_hand_reaches_the_published_range() -> None:
    """A knee cylinder of 295 to 317 mm, and a knee force up to about 3 kN."""
    result = vpm.Scenario.load(hyl.HYL / "quasi_static.toml").run()
    assert result.failures == {}
    lengths = np.concatenate([run["knee_cylinder.length"] for run in result.runs.values()])
    forces = np.concatenate([run["knee_drive.force"] for run in result.runs.values()])
    assert 0.295 < lengths.min() < 0.300
    assert 2500.0 < forces.max() < 3300.0


def test_soft_bearings_ring_and_stiff_ones_do_not() -> None:
    """The table of docs/hyl.md, from what draws its picture."""
    drawn = SimpleNamespace(**runpy.run_path(str(hyl.HYL.parent.parent / "docs" / "figures" / "hyl.py")))
    found = {name: (run["foot.normal_force"].max(), *drawn.dominant(run)) for name, run in drawn.study()}
    rigid, stiff = found["rigid"], found["1e+08 N/m"]
    assert stiff[0] == pytest.approx(rigid[0], rel=2e-3)
    assert max(rigid[2], stiff[2]) < 0.3
    for name, frequency in (("1e+06 N/m", 109.0), ("3e+06 N/m", 194.0), ("1e+07 N/m", 338.0)):
        peak, dominant, amplitude = found[name]
        assert dominant == pytest.approx(frequency, abs=2.0)
        assert amplitude > 4.0
        assert 0.84 < peak / rigid[0] < 0.88
