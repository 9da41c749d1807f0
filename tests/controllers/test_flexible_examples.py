"""What the flexible model in the controller is worth on TUDOR and on the leg: the examples, and their targets."""

import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from places import EXAMPLES

pytestmark = pytest.mark.nightly


def table(
    folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> tuple[str, dict[str, list[float]]]:
    """What an example prints, and the numbers of each row of its table."""
    monkeypatch.setattr("sys.argv", ["control.py", str(tmp_path), "--seeds", "3"])
    runpy.run_path(str(EXAMPLES / folder / "control.py"), run_name="__main__")
    assert (tmp_path / "control.png").stat().st_size > 5000
    printed = capsys.readouterr().out
    rows = re.findall(r"^(\S.*?)  +((?:\d+\.\d+ +)+\d+\.\d+)$", printed, re.MULTILINE)
    return printed, {name: [float(value) for value in values.split()] for name, values in rows}


def test_tudor_is_better_than_with_the_rigid_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    printed, rows = table("tudor", tmp_path, monkeypatch, capsys)
    # The targets: 5 times with the right values, 3 times where they are 10 % wrong, a fifth of 1 ms for a step.
    assert min(rows["nominal"][-2:]) > 5.0
    wrong = np.array([row[-2:] for name, row in rows.items() if name.startswith("10 %")])
    assert wrong.shape == (3, 2)
    assert wrong.min() > 3.0
    assert len(rows) == 12
    assert "a step of observer, feedback and feed-forward" in printed


def test_the_leg_is_better_than_with_the_rigid_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    _, rows = table("hyl", tmp_path, monkeypatch, capsys)
    assert len(rows) == 7
    assert np.array([row[-2:] for row in rows.values()]).min() > 1.0
