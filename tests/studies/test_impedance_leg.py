"""Tests on the simulated HyL leg find the gains of its controllers."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from places import EXAMPLES
from vpm import impedance


@pytest.fixture(scope="module")
def example() -> ModuleType:
    spec = importlib.util.spec_from_file_location("hyl_impedance", EXAMPLES / "hyl" / "impedance.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["hyl_impedance"] = module
    spec.loader.exec_module(module)
    return module


def test_the_linkage_of_the_example_is_that_of_the_model(example: ModuleType) -> None:
    run = example.dropped("ideal", "low", np.random.default_rng(0))
    for joint in ("hip", "knee"):
        own = example.length(joint, run[f"{joint}_rotation.position"])
        # Bearings of 1e8 N/m yield by some um.
        np.testing.assert_allclose(own, run[f"{joint}_cylinder.length"], atol=2e-5)


@pytest.mark.parametrize("name", ["low", "high"])
def test_tests_on_the_leg_find_the_gains_of_its_controllers(
    example: ModuleType, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(example, "CYCLES", 2)
    found = example.repeated("ideal", name, 2)
    for joint in ("hip", "knee"):
        for estimates, truths, within in (
            (found.loops, found.truths, (0.03, 0.03)),
            (found.landings, found.landing_truths, (0.02, 0.03)),
        ):
            row = impedance.repeat_tests(joint, name, "test", estimates[joint])
            known = truths[joint]
            assert row.stiffness.mean == pytest.approx(known.stiffness, rel=within[0])
            assert row.damping.mean == pytest.approx(known.damping, rel=within[1])


def test_the_example_prints_its_tables(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pytest.importorskip("matplotlib")
    for name, value in {"CYCLES": 1, "FREQUENCY": 0.5, "SWEEP": (0.4, 0.8)}.items():
        monkeypatch.setattr(example, name, value)
    example.main(2, tmp_path, ("ideal",))
    printed = capsys.readouterr().out
    assert "ideal leg, 2 tests each" in printed
    assert "force 5 ms late" in printed
    assert {path.name for path in tmp_path.iterdir()} == {"impedance_ideal.png", "loops_ideal.png"}


def test_a_late_load_cell_of_the_leg_costs_stiffness_times_delay(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(example, "CYCLES", 2)
    (_, now, _), (shift, late, told) = example.delays((0, 5))
    assert late.damping - now.damping == pytest.approx(-now.stiffness * 1e-3 * shift, rel=0.03)
    assert told.damping == pytest.approx(now.damping, rel=2e-3)


def test_damping_of_the_hydraulic_leg_is_what_the_valve_is_not_told_of_the_pistons_speed(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(example, "CYCLES", 2)
    (none, slow), (all_of_it, quick) = example.compensated((0.0, 10.67e-3))
    # The force loop of 3e-7 A/N answers a speed that nothing compensates with (k_v' - k_v) / k_f newtons.
    assert slow.damping - quick.damping == pytest.approx((all_of_it - none) / 3e-7, rel=0.25)
