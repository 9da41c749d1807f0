"""Data sets of LeRobot, versions 2 and 3: each episode is a log."""

import json
import re
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from vpm.errors import ExperimentError, needs
from vpm.experiment.readers.base import Log
from vpm.experiment.table import Table
from vpm.numbers import Array

#: Columns that every data set has.
CLOCK, EPISODE, FRAME = "timestamp", "episode_index", "frame_index"
#: LeRobot takes stamps that differ by less from the times of frames for these (its ``tolerance_s``), s.
TOLERANCE = 1e-4
_NAME = re.compile(r"episode_(\d+)")


def is_data_set(path: str | PathLike[str]) -> bool:
    """Whether a folder is a LeRobot data set."""
    return (Path(path) / "meta" / "info.json").is_file()


def is_episode(path: str | PathLike[str]) -> bool:
    """Whether a path, which is no file, names a LeRobot episode: ``FOLDER/episode_000003``."""
    return _NAME.fullmatch(Path(path).name) is not None and is_data_set(Path(path).parent)


def episodes_of(folder: str | PathLike[str]) -> list[Path]:
    """Paths of the episodes of a LeRobot data set, in their order."""
    numbers = _table(Path(folder), [EPISODE]).column(EPISODE).unique().to_pylist()
    return [Path(folder) / f"episode_{number:06d}" for number in sorted(n for n in numbers if n is not None)]


class EpisodeLog(Log):
    """Columns of an episode: ``reward``, and ``observation.state[2]`` or ``observation.state.NAME`` of a vector.

    ``time`` and ``timestamp`` are its clock.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        super().__init__(path)
        place = Path(path)
        if not is_episode(place):
            episodes = episodes_of(place)
            if len(episodes) != 1:
                raise self.error(
                    f"{path} is a data set of {len(episodes)} episodes; load them by Campaign.load, or one of them as "
                    f"{episodes[0] if episodes else place / 'episode_000000'}"
                )
            place = episodes[0]
        self._info = _info(place.parent)
        self._table = _table(place.parent, None, int(place.name.partition("_")[2]))
        if not self._table.num_rows:
            raise self.error(f"{place.parent} has no {place.name}; name one that it has")
        self._places: dict[str, tuple[str, int | None]] = {"time": (CLOCK, None)}
        self._aliases: dict[str, str] = {CLOCK: "time"}
        for field in self._table.schema:
            if field.name != CLOCK:
                self._add(field.name, field.type)
        self.header = tuple(self._places)

    def _add(self, name: str, kind: Any) -> None:  # noqa: ANN401
        """Sort a column of a LeRobot table into numbers, vectors and what is no column."""
        import pyarrow as pa

        inner = kind.value_type if pa.types.is_list(kind) or pa.types.is_fixed_size_list(kind) else kind
        if not (pa.types.is_integer(inner) or pa.types.is_floating(inner) or pa.types.is_boolean(inner)):
            self.refused[name] = f"holds {str(kind)[:60]}, which is no number; map a column of numbers"
            return
        if inner is kind:
            self._places[name] = (name, None)
            return
        width = len(self._table.column(name)[0].as_py() or ())
        names = _component_names(self._info, name)
        named = len(names) == width and len(set(names)) == width
        for at in range(width):
            column = f"{name}.{names[at]}" if named else f"{name}[{at}]"
            self._places[column] = (name, at)
            self._aliases[f"{name}[{at}]"] = column

    def find(self, column: str) -> str | None:
        """Name of a column of an episode of LeRobot, a component also by its number; see `Log.find`."""
        return super().find(self._aliases.get(column, column))

    def _read(self, columns: Sequence[str], clock: str) -> Table:
        """Columns of an episode of LeRobot by name; see `Log.read`."""
        found = {column: self._values(*self._places[column]) for column in columns}
        notes: tuple[str, ...] = ()
        rate = self._info.get("fps")
        if clock == "time" and FRAME in self._places and isinstance(rate, int | float) and rate > 0.0:
            exact = self._values(FRAME, None) / rate
            if np.all(np.abs(found[clock] - exact) < TOLERANCE):
                # Stamps are single precision, which would leave steps uneven.
                found[clock] = exact
                notes = (f"Stamps are those of frames at {rate:g} Hz, to {TOLERANCE:g} s.",)
        return Table(self.header, found, None, notes=notes)

    def _values(self, name: str, at: int | None) -> Array:
        column = self._table.column(name).combine_chunks()
        if at is None:
            return np.asarray(column.to_numpy(zero_copy_only=False), dtype=np.float64)
        rows = [() if row is None else row for row in column.to_pylist()]
        width = len(rows[0])
        for number, row in enumerate(rows):
            if len(row) != width:
                raise self.error(f'{self.path}: row {number} of "{name}" has {len(row)} numbers, the first {width}')
        return np.array([np.nan if row[at] is None else row[at] for row in rows], dtype=np.float64)


def _info(folder: Path) -> dict[str, Any]:
    """Content of ``meta/info.json`` of a data set of LeRobot."""
    told = json.loads((folder / "meta" / "info.json").read_text(encoding="utf-8"))
    if not isinstance(told, dict):
        raise ExperimentError(f"{folder}/meta/info.json is no table; copy the data set anew", path=str(folder))
    return told


def _component_names(info: dict[str, Any], name: str) -> list[str]:
    """Component names of a LeRobot vector: a list, or one in a table such as ``{"motors": [...]}``."""
    features = info.get("features")
    feature = features.get(name) if isinstance(features, dict) else None
    names = feature.get("names") if isinstance(feature, dict) else None
    if isinstance(names, dict) and len(names) == 1:
        (names,) = names.values()
    return [str(each) for each in names] if isinstance(names, list) else []


def _table(folder: Path, columns: list[str] | None, episode: int | None = None) -> Any:  # noqa: ANN401
    """Rows of LeRobot files, or those of an episode; files hold one or several, by version."""
    with needs("pyarrow", "parquet"):
        import pyarrow as pa
        import pyarrow.parquet as pq
    files = sorted((folder / "data").glob("*/*.parquet"))
    own = [file for file in files if episode is not None and file.stem == f"episode_{episode:06d}"]
    if not files:
        raise ExperimentError(
            f"{folder} has no files data/chunk-*/*.parquet; copy the data set with its data", path=str(folder)
        )
    if columns is None:  # pictures are structures, and large
        columns = [field.name for field in pq.read_schema(files[0]) if not pa.types.is_struct(field.type)]
    rows = None if episode is None else [(EPISODE, "==", episode)]
    return pq.read_table([str(file) for file in own or files], columns=columns, filters=rows, partitioning=None)
