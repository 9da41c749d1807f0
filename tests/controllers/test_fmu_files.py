"""FMUs as files: the same bytes again, what the command says, and what is refused; nothing of it is compiled."""

import zipfile
from pathlib import Path
from typing import Any

import pytest

from command_line import ran, vpm
from places import EXAMPLES
from vpm import Model, write_fmu
from vpm.errors import SimulationError
from vpm.files import FileError
from vpm.realtime import c_source


def test_the_same_model_gives_the_same_bytes_and_another_token_otherwise(emps: Model, tmp_path: Path) -> None:
    def token(name: str, model: Model, **options: Any) -> str:
        return write_fmu(model, tmp_path / name, library=False, **options).token

    assert token("a.fmu", emps) == token("b.fmu", emps)
    assert (tmp_path / "a.fmu").read_bytes() == (tmp_path / "b.fmu").read_bytes()
    mass = next(name for name in emps.parameters if name.endswith(".mass"))
    heavier = emps.with_parameters({mass: 1.01 * emps.parameters[mass].value})
    tokens = {token("c.fmu", heavier), token("c.fmu", emps, rate=500.0), token("a.fmu", emps)}
    assert len(tokens) == 3
    with zipfile.ZipFile(tmp_path / "a.fmu") as archive:
        assert not [name for name in archive.namelist() if name.startswith("binaries")]
        assert archive.testzip() is None


def test_the_command_writes_one_and_says_what_it_leaves_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    axis = str(EXAMPLES / "emps" / "model.toml")
    done = ran("compile", axis, "--fmu", str(tmp_path / "a.fmu"), "--parameter", "*.mass")
    assert (tmp_path / "a.fmu").is_file()
    assert "takes drive.command" in done.stdout
    assert "carriage.mass" in done.stdout
    assert "there is no C compiler" in done.stderr
    assert vpm("compile", axis, "--fmu", tmp_path / "b.fmu", "--c", tmp_path / "c").returncode != 0


def test_what_cannot_be_is_refused_in_one_sentence(
    emps: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "a.fmu"
    with pytest.raises(SimulationError, match="cannot step by 'additive'"):
        write_fmu(emps, place, integrator="additive")
    with pytest.raises(SimulationError, match="a rate of 0 Hz"):
        write_fmu(emps, place, rate=0.0)
    with pytest.raises(SimulationError, match="substeps is 0"):
        write_fmu(emps, place, substeps=0)
    with pytest.raises(FileError, match="cannot be written"):
        write_fmu(emps, tmp_path / "nowhere" / "a.fmu")
    monkeypatch.setenv("CC", "no-such-compiler")
    assert any("sources alone" in note for note in write_fmu(emps, place).notes)
    with pytest.raises(SimulationError, match="there is no C compiler"):
        write_fmu(emps, place, library=True)
    assert c_source(emps, name="m").entries("rates", "u") == [(1, 0)]
