"""A column of a value over several that is late against the others: read, found, and written down."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import vpm
from series_elastic_knee import COUNTS, KNEE, swung
from vpm.errors import ModelError
from vpm.model import load_channel_table

#: Both encoders of the knee: the motor's in counts, the link's in degrees, whose difference is the spring's deflection.
READ = 'link = { column = "link", unit = "deg" }, motor = "counts"'
TABLE = f"""
[channels]
time = {{ column = "time", unit = "s" }}
"motor.command" = {{ column = "current", unit = "A" }}
"knee.position" = {{ column = "counts", unit = "rad", scale = {COUNTS!r} }}
"knee_deflection.position" = {{ value = "link - {COUNTS!r} * motor", columns = {{ {READ} }}, unit = "rad" }}
"""


def written(path: Path, late: int) -> Path:
    """Log of a knee whose link is read some samples late, as the columns of `TABLE`."""
    log = swung(1, late)
    motor, deflection = log["knee.position"], log["knee_deflection.position"]
    columns = [log.time, log["motor.command"], np.round(motor / COUNTS), np.degrees(motor + deflection)]
    np.savetxt(path, np.column_stack(columns), delimiter=",", header="time,current,counts,link", comments="")
    return path


def test_a_link_encoder_that_is_late_in_a_deflection_is_found(tmp_path: Path) -> None:
    """Its line of the table repairs it, and a knee whose encoders agree has none."""
    path, model = written(tmp_path / "late.csv", 4), vpm.Model.from_toml(KNEE + TABLE)
    (one,) = vpm.check_log(model, vpm.Experiment.load(path, model=model), workers=1).mistakes
    assert (one.kind, one.channels) == ("delay", ("knee_deflection.position",))
    assert "the column link of knee_deflection.position comes" in one.sentence
    assert one.delay == pytest.approx(4e-3, abs=5e-4)
    (tmp_path / "table.toml").write_text("\n".join([*TABLE.splitlines()[2:5], *one.lines.values()]), encoding="utf-8")
    repaired = vpm.Experiment.load(path, load_channel_table(tmp_path / "table.toml"), model)
    right = vpm.Experiment.load(written(tmp_path / "right.csv", 0), model=model)
    late, here, there = (
        log["knee_deflection.position"][100:9000] for log in (vpm.Experiment.load(path, model=model), repaired, right)
    )
    assert np.std(here - there) < 0.1 * np.std(late - there)
    assert not vpm.check_log(model, right, workers=1).mistakes


def test_a_delay_of_a_column_moves_it_alone(tmp_path: Path) -> None:
    """Of x(t - 20 ms) - y(t) nothing is left where x = y."""
    time = np.arange(500) / 250.0
    wave, behind = np.sin(5.0 * time), np.sin(5.0 * (time - 0.02))
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([time, behind, wave]), delimiter=",", header="t,x,y", comments="")
    columns = 'x = { column = "x", unit = "rad", delay = 0.02 }, y = { column = "y", unit = "rad" }'
    entry = f'"gap.position" = {{ value = "x - y", columns = {{ {columns} }}, unit = "rad" }}'
    clock = 'time = { column = "t", unit = "s" }'
    (tmp_path / "table.toml").write_text(f"{clock}\n{entry}\n", encoding="utf-8")
    log = vpm.Experiment.load(path, tmp_path / "table.toml")
    assert log.time[-1] == pytest.approx(time[-1] - 0.02)
    np.testing.assert_allclose(log["gap.position"], 0.0, atol=1e-7)
    assert any('column "x" was moved back by 0.02 s' in sentence for sentence in log.history)


def test_a_counter_that_wraps_has_no_delay_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "table.toml").write_text(
        'x = { value = "unwrap(n, 4096)", columns = { n = { column = "n", delay = 0.01 } }, unit = "1" }',
        encoding="utf-8",
    )
    with pytest.raises(ModelError, match=r"has a delay of columns\.n, which jumps in .*; delay the whole channel"):
        load_channel_table(tmp_path / "table.toml")
