"""The scripts of flexible machines run, print their tables and plot."""

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.parametrize(
    ("script", "pictures", "words"),
    [
        # 0.5738 m: largest deflection of two independent codes, values/beams.json, spin_up_manoeuvre.
        ("spinning_beam", {"spin_up.png"}, ("strain(6)                 0.5738", "beyond the arm's own length")),
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
    runpy.run_path(str(ROOT / "examples" / script / "run.py"), run_name="__main__")
    assert {path.name for path in tmp_path.iterdir()} == pictures
    assert all(path.stat().st_size > 5000 for path in tmp_path.iterdir())
    printed = capsys.readouterr().out
    assert all(word in printed for word in words), printed


def test_the_published_table_is_sought_by_a_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["table.py"])
    runpy.run_path(str(ROOT / "examples" / "tudor" / "table.py"), run_name="__main__")
    printed = capsys.readouterr().out
    # Two rows of docs/tudor.md: the published means, and what the arm reaches without a factor on its gauges.
    assert "1470.0" in printed
    assert "-76.9" in printed
