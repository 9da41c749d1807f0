"""The planar flexible arm from Python: accuracy, sizes, references, restarts, errors."""

import _thread
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from reference_arm import DURATION, MOTIONS, errors, planar_arm, swing
from vpm.errors import DivergedError, ModelError
from vpm.linkages import Leg
from vpm.planar import FlexibleLink, Gauge, PlanarArm, PlanarRun, SampledReference, Swing

STRIP = {"young": 210e9, "density": 7850.0}


@pytest.mark.parametrize("motion", MOTIONS)
def test_four_coefficients_and_2_ms_track_the_reference(motion: str) -> None:
    run = planar_arm(motion, 4, 5).run(DURATION, samples=241, steps=50)
    tip, strain = errors(motion, run.tip[1:], run.strains[1:])
    assert run.step == pytest.approx(2e-3)
    assert tip <= 3e-5
    assert strain[0] <= 4e-4
    assert strain[1] <= 2.5e-3


@pytest.mark.parametrize("motion", MOTIONS)
def test_order_4_tracks_the_reference_in_steps_of_10_ms(motion: str) -> None:
    run = planar_arm(motion, 4, 5, order=4).run(DURATION, samples=241, steps=10)
    tip, strain = errors(motion, run.tip[1:], run.strains[1:])
    assert tip <= 1e-6
    assert strain[0] <= 4e-4
    assert strain[1] <= 2.5e-3


def test_more_coefficients_come_nearer() -> None:
    found = [errors("fast", *_tip_and_strains(coefficients))[0] for coefficients in (2, 3, 4)]
    assert found[0] > 3.0 * found[1] > 0.0
    assert found[1] > found[2]


def _tip_and_strains(coefficients: int) -> tuple[np.ndarray, np.ndarray]:
    run = planar_arm("fast", coefficients, 7).run(2.0, samples=21, steps=1000)
    return run.tip[1:], run.strains[1:]


def test_sampled_references_are_followed_as_formulas() -> None:
    arm = planar_arm("fast", 3, 5)
    time = np.linspace(0.0, 3.0, 301)
    wanted = swing("fast")
    rate = np.pi * wanted.amplitude / wanted.period * np.sin(2.0 * np.pi * time / wanted.period)
    table = SampledReference(0.01, np.stack([wanted.angle(time)] * 2, axis=1), np.stack([rate] * 2, axis=1))
    sampled = PlanarArm(arm.links, [(400.0, 10.0), (50.0, 0.5)], table, arm.gauges, coefficients=3)
    left, right = arm.run(3.0, 31, 50), sampled.run(3.0, 31, 50)
    # A cubic over 10 ms leaves h^4 / 384 times the fourth derivative: 1.3e-9 rad.
    assert np.abs(left.tip - right.tip).max() < 1e-8
    np.testing.assert_allclose(left.reference, right.reference, atol=1e-12)


def test_a_run_continues_where_another_ended() -> None:
    arm = PlanarArm(
        [FlexibleLink.strip(0.5, 0.02, 0.003, **STRIP, damping=1e-3, hub_inertia=0.01)],
        [(0.0, 0.0)],  # a free pendulum, so that time itself plays no part
        Swing(0.0, 1.0),
        [Gauge(0, 0.0, 0.0015)],
        coefficients=3,
    )
    whole, first = arm.run(2.0, 21, 40), arm.run(1.0, 11, 40)
    second = arm.run(1.0, 11, 40, start=first.states[-1])
    np.testing.assert_allclose(second.tip, whole.tip[10:], atol=1e-12)
    # One joint: the joint's angle is the first coordinate.
    np.testing.assert_allclose(whole.angles[:, 0], whole.states[:, 0])


@pytest.mark.parametrize("coefficients", [2, 3, 4])
def test_a_stiff_link_is_a_rigid_pendulum(coefficients: int) -> None:
    length, width, height = 0.3, 0.03, 0.03
    link = FlexibleLink.strip(length, width, height, **STRIP, damping=1e-4)
    arm = PlanarArm([link], [(0.0, 0.0)], Swing(0.0, 1.0), coefficients=coefficients)
    run = arm.run(0.2, 21, 200)
    # Energy of a uniform rod that falls from the horizontal: 1/2 (m L^2 / 3) w^2 = m g L / 2 sin(-angle).
    wanted = np.sqrt(3.0 * 9.81 * np.sin(-run.angles[:, 0]) / length)
    np.testing.assert_allclose(-run.rates[5:, 0], wanted[5:], rtol=2e-3)


def test_a_cantilever_sags_as_its_closed_form() -> None:
    length, width, height = 0.4, 0.02, 0.004
    link = FlexibleLink.strip(length, width, height, **STRIP, damping=0.02, hub_inertia=1.0)
    arm = PlanarArm([link], [(1e6, 1e4)], Swing(0.0, 1.0), [Gauge(0, 0.0, height / 2)])
    run = arm.run(4.0, 5, 1000)
    load = 9.81 * link.line_density
    assert run.strains[-1, 0] == pytest.approx(-load * length**2 / 2 / link.bending * height / 2, rel=1e-3)
    assert run.tip[-1, 1] == pytest.approx(-load * length**4 / 8 / link.bending, rel=2e-3)


def test_a_run_prints_stores_plots_and_becomes_a_table(tmp_path: Path) -> None:
    run = planar_arm("slow", 2, 4).run(1.0, 101, 5)
    assert repr(run) == "PlanarRun(duration_s=1, samples=101, step_s=0.002)"
    assert PlanarRun.load(run.save(tmp_path / "run.npz")) == run
    assert list(run.to_frame())[:3] == ["time_s", "tip_x_m", "tip_y_m"]
    run.plot().savefig(tmp_path / "run.png")
    assert (tmp_path / "run.png").stat().st_size > 5000


def test_what_cannot_be_is_refused_in_one_sentence() -> None:
    link, still = FlexibleLink(0.4, 10.0, 0.5), Swing(0.0, 1.0)
    with pytest.raises(ModelError, match="1 or 2 links with 2, 3 or 4 curvature coefficients each, not 3 with 4"):
        PlanarArm([link] * 3, [(1.0, 0.0)] * 3, still)
    with pytest.raises(ModelError, match="not 1 with 5"):
        PlanarArm([link], [(1.0, 0.0)], still, coefficients=5)
    with pytest.raises(ModelError, match="order 2 or 4, not 3"):
        PlanarArm([link], [(1.0, 0.0)], still, order=3)
    with pytest.raises(ModelError, match="there are 1 servos for 2 links"):
        PlanarArm([link] * 2, [(1.0, 0.0)], still)
    with pytest.raises(ModelError, match=r"link\.bending"):
        PlanarArm([FlexibleLink(0.4, -10.0, 0.5)], [(1.0, 0.0)], still)
    arm = PlanarArm([link], [(1.0, 0.0)], still, [Gauge(1, 0.1, 0.002)])
    with pytest.raises(ModelError, match=r"gauge 0 sits 0\.1 m along link 1"):
        arm.run(1.0, 11, 10)
    with pytest.raises(ModelError, match="2 samples and 1 step"):
        PlanarArm([link], [(1.0, 0.0)], still).run(1.0, 1, 10)
    table = SampledReference(0.1, np.zeros((4, 1)), np.zeros((4, 1)))
    with pytest.raises(ModelError, match=r"the reference ends at 0\.3"):
        PlanarArm([link], [(1.0, 0.0)], table).run(1.0, 11, 10)


def test_a_run_that_diverges_says_when() -> None:
    arm = planar_arm("fast", 3, 5)
    start = np.zeros(16)
    start[9] = 1e160
    with pytest.raises(DivergedError, match="no longer finite at t = "):
        arm.run(1.0, 11, 50, start=start)


@pytest.mark.parametrize(
    "long",
    [
        lambda: planar_arm("slow", 4, 40).run(36_000.0, samples=3601, steps=5000),
        lambda: Leg.hyq().shares(samples=60, second=np.linspace(-2.4, -0.4, 400)),
    ],
    ids=["planar arm", "shares of a leg"],
)
def test_ctrl_c_stops_a_long_computation(long: Callable[[], object]) -> None:
    timer = threading.Timer(0.3, _thread.interrupt_main)
    timer.start()
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        long()
    assert time.monotonic() - begin < 5.0
