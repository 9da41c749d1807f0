"""The scripts of flexible machines run, print their tables and plot."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import vpm
from places import EXAMPLES


@pytest.mark.parametrize(
    ("script", "pictures", "words"),
    [
        # 0.5738 m: largest deflection of two independent codes, values/beams.json, spin_up_manoeuvre.
        ("spinning_beam", {"spin_up.png"}, ("bezier(7)                 0.5738", "beyond the arm's own length")),
        # 0.9963 m and -0.0447 m at 0.1 s: the same, falling_flexible_pendulum, printed to 1e-4 m.
        ("flexible_pendulum", {"strobe.png", "energies.png"}, ("0.1      0.9963", "largest kinetic energy")),
        # 36.834 and 46.522 bar, 11.513 mm after 50 ms: hydraulic_reference.STEP, printed to 1e-3.
        (
            "servo_cylinder",
            {"step.png"},
            ("constant         50    11.513      36.834      46.522", "sagging         200"),
        ),
        # The first gauge shows 633 µm/m at rest in the horizontal (values/tudor.json); the swing begins there.
        (
            "tudor",
            {f"motion_{name}.png" for name in "abcdef"},
            ("a both joints slow: gauge_1 mean 50", "f opposite, fast"),
        ),
    ],
)
def test_examples_run_and_plot(
    script: str,
    pictures: set[str],
    words: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("sys.argv", ["run.py", str(tmp_path)])
    runpy.run_path(str(EXAMPLES / script / "run.py"), run_name="__main__")
    assert {path.name for path in tmp_path.iterdir()} == pictures
    assert all(path.stat().st_size > 5000 for path in tmp_path.iterdir())
    printed = capsys.readouterr().out
    assert all(word in printed for word in words), printed


def test_the_step_of_the_drive_arrives() -> None:
    result = vpm.Scenario.load(EXAMPLES / "emps" / "step.toml").run()
    assert not result.failures
    for name in result.runs:
        position = next(row for row in result.extremes(name) if row.channel == "axis.position")
        # At rest, 20 N of dry friction over 35.15 N/V and 243.45 * 160.18 V/m may keep 15 um of the 2 mm.
        assert position.final == pytest.approx(2e-3, abs=15e-6)
        assert position.largest > 2.4e-3


def test_the_strip_that_is_let_go_falls_as_a_rod_if_it_is_stiff() -> None:
    result = vpm.Scenario.load(EXAMPLES / "flexible_pendulum" / "release.toml").run()
    assert list(result.runs) == ["bezier(7)", "bezier(3)", "rigid"]
    # A uniform rod of 1 m about its end: (l^2/3) d2q/dt2 = -g (l/2) cos q.
    fall = solve_ivp(lambda _, x: (x[1], -1.5 * 9.81 * np.cos(x[0])), (0.0, 1.0), (np.pi / 6, 0.0), rtol=1e-9)
    assert result["rigid"]["pivot.position"][-1] == pytest.approx(fall.y[0, -1], abs=1e-3)
    # Gravity has bent the soft one at rest: held at 30 degrees upward, its tip begins 0.6 m below its root.
    assert result["bezier(7)"]["tip.z"][0] < -0.5
    assert result["rigid"]["tip.z"][0] == pytest.approx(0.5)


def test_the_published_table_is_sought_by_a_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["table.py"])
    runpy.run_path(str(EXAMPLES / "tudor" / "table.py"), run_name="__main__")
    printed = capsys.readouterr().out
    # Two rows of docs/tudor.md: the published means, and what the arm reaches without a factor on its gauges.
    assert "1470.0" in printed
    assert "-76.9" in printed
