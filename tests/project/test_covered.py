"""The table of ``make coverage``: rooms, shares, and the bound."""

import json
from pathlib import Path
from typing import Any

import pytest

from covered import main

# Two rooms of the package: 18 of 20 lines.
PYTHON = {
    "files": {
        "python/vpm/model/joint.py": {"summary": {"num_statements": 8, "covered_lines": 8}},
        "python/vpm/model/link.py": {"summary": {"num_statements": 2, "covered_lines": 1}},
        "python/vpm/rank_command.py": {"summary": {"num_statements": 5, "covered_lines": 4}},
        "python/vpm/view_command.py": {"summary": {"num_statements": 5, "covered_lines": 5}},
    }
}


def core(run: int) -> dict[str, Any]:
    """A file of the core, of which that many of 1000 lines ran, and one from elsewhere that does not count."""
    file = {
        "filename": "/clone/crates/vpm-core/src/beam/basis.rs",
        "summary": {"lines": {"count": 1000, "covered": run}},
    }
    other = {"filename": "/cargo/registry/src/lib.rs", "summary": {"lines": {"count": 9999, "covered": 0}}}
    return {"data": [{"files": [file, other]}]}


def code(folder: Path, python: dict[str, Any], rust: dict[str, Any]) -> int:
    for name, text in (("python.json", python), ("core.json", rust)):
        (folder / name).write_text(json.dumps(text), encoding="utf-8")
    return main(folder / "python.json", folder / "core.json")


def test_lines_are_summed_by_room(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert code(tmp_path, PYTHON, core(900)) == 0
    table = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["model", "10", "9", "90.0", "%"] in table
    assert ["commands", "10", "9", "90.0", "%"] in table
    assert ["beam", "1000", "900", "90.0", "%"] in table
    assert [row for row in table if row[:1] == ["all"]] == [
        ["all", "20", "18", "90.0", "%"],
        ["all", "1000", "900", "90.0", "%"],
    ]


def test_either_part_fails_below_the_bound(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert code(tmp_path, PYTHON, core(899)) == 1
    assert "899 of 1000 lines of crates/vpm-core/src/, less than 90 %" in capsys.readouterr().err
    less = json.loads(json.dumps(PYTHON))
    less["files"]["python/vpm/rank_command.py"]["summary"]["covered_lines"] = 3
    assert code(tmp_path, less, core(900)) == 1


def test_a_measurement_of_nothing_fails(tmp_path: Path) -> None:
    assert code(tmp_path, {"files": {}}, core(900)) == 1
