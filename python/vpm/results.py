"""The manners that every result shares: one-line ``repr``, HTML table, ``save``/``load``, ``to_frame``, equality.

A result is a frozen dataclass on top of `Result`::

    @dataclass(frozen=True, repr=False, eq=False)
    class Run(Result):
        time: Array
        outputs: Array
        channels: tuple[str, ...]

        def _frame_columns(self) -> Mapping[str, object]:
            return {"time_s": self.time, **dict(zip(self.channels, self.outputs.T))}

``repr=False, eq=False`` keeps the versions of this module, which know arrays. A class may narrow ``_headline`` (what
the one-line repr shows) and ``_html_rows`` (what the table shows), and must give ``_frame_columns`` if it has a table
form.

Fields may be None, bool, int, float, str, ndarray (numbers or bool), tuple, list, dict with str keys, or another
`Storable`: a result, a nested frozen dataclass (``class Part(Storable)`` with the same decorator) or a class that
writes ``to_stored``/``from_stored`` itself, as `vpm.model.Model` does.

A file is a numpy ``.npz``: the arrays, and one JSON text with all the rest. Nothing in it is executed on loading; only
subclasses of `Storable` are ever built, and a file of another class is refused.
"""

from __future__ import annotations

import html
import json
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from os import PathLike
from pathlib import Path
from tokenize import TokenError
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from vpm.errors import VpmError, needs
from vpm.fields import misfit
from vpm.files import replacing, unreadable
from vpm.json_values import plain
from vpm.moved import present_name

if TYPE_CHECKING:
    import pandas as pd

#: Written into every file; changes when an old reader could misread a new file.
FORMAT = 1

_HEADER = "header"
#: What reading a broken archive raises, and building a class from content that is not its own.
_BROKEN = (
    *(OSError, EOFError, MemoryError, NotImplementedError, RuntimeError),
    *(struct.error, zipfile.BadZipFile, zlib.error),
    *(SyntaxError, TokenError),  # NumPy reads the head of an array as Python's text
)
_MISFIT = (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError)
_TAG = "$"

#: Modules whose classes stand in files, by their package: loading a file imports nothing else. A class of a program's
#: own has to be imported by that program before.
_MODULES: Mapping[str, tuple[str, ...]] = {
    "vpm": ("linear",),
    "vpm.budget": ("report",),
    "vpm.climb": ("result",),
    "vpm.compare": ("comparison", "correlation", "regions"),
    "vpm.control": ("feedback", "plan", "schedule"),
    "vpm.discrepancy": ("diagnosis", "evidence", "provenance"),
    "vpm.excitation": ("base_parameters", "excitation", "fourier", "limits"),
    "vpm.experiment": ("campaign", "motion", "record"),
    "vpm.identify": (
        "fit_result",
        "identifiability",
        "inertial_fit",
        "inertial_regression",
        "intervals",
        "settings",
        "whiteness",
    ),
    "vpm.log_check": ("finding",),
    "vpm.model": ("model",),
    "vpm.narx": ("maxwell", "maxwell_records", "maxwell_result", "model", "run", "validation"),
    "vpm.observer": ("noise", "observation"),
    "vpm.optimise": ("optimum",),
    "vpm.ranking": ("judgement", "result"),
    "vpm.realtime": ("loop",),
    "vpm.scenario": ("outcome",),
    "vpm.simplify": ("pareto_front", "reductions", "replacement"),
    "vpm.simulate": ("resolution", "run", "setup"),
    "vpm.studies.impedance": ("decay", "hysteresis_loop", "impact", "landing", "loss", "repeated"),
    "vpm.studies.linkages": ("dropping", "karl", "karl_results", "leg_parameters", "leg_results"),
    "vpm.studies.maxwell": ("maps", "runs", "windows"),
    "vpm.studies.oil": ("equations", "fit"),
    "vpm.weighing": ("weigh",),
}

#: Every subclass of `Storable`, by "module:class": the only classes that loading a file can build.
_STORED_CLASSES: dict[str, type[Storable]] = {}


def _class_name(cls: type) -> str:
    return f"{cls.__module__}:{cls.__qualname__}"


class Storable:
    """Something that can stand in a result's file: by default a dataclass, field by field."""

    #: Fields with a number for every sample, which `to_dict` leaves out and files have.
    _samples: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        _STORED_CLASSES[_class_name(cls)] = cls

    def to_stored(self) -> Mapping[str, object]:
        """Content of a result as a mapping of names to storable values."""
        return {name: getattr(self, name) for name in _field_names(self)}

    def to_dict(self) -> dict[str, Any]:
        """Attributes of a result by name as JSON has them, without samples: SI; unknown is None."""
        shown = self.to_stored().items()
        return {name: plain(value) for name, value in shown if not name.startswith("_") and name not in self._samples}

    @classmethod
    def from_stored(cls, content: Mapping[str, Any]) -> Self:
        """Build a result from what `to_stored` gave."""
        return cls(**content)

    def _headline(self) -> Mapping[str, object]:
        """Names and values that a result's one-line repr shows."""
        return {name: getattr(self, name) for name in _field_names(self) if not name.startswith("_")}

    def __repr__(self) -> str:
        inside = ", ".join(f"{name}={_short(value)}" for name, value in self._headline().items())
        return f"{type(self).__name__}({inside})"

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return _same(self.to_stored(), other.to_stored())

    def __hash__(self) -> int:
        raise TypeError(f"a {type(self).__name__} is equal by content and has no hash, because arrays have none")


class Result(Storable):
    """A frozen outcome of one step of the program."""

    def _frame_columns(self) -> Mapping[str, object]:
        """Columns of a result's `to_frame`: names to equally long sequences."""
        raise VpmError(f"{type(self).__name__} has no table form")

    def _html_rows(self) -> Mapping[str, object]:
        """Rows of a result's HTML table, its notes below."""
        return {**self._headline(), **{f"note {at}": note for at, note in enumerate(getattr(self, "notes", ()), 1)}}

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, ("field", "value"), list(self._html_rows().items()))

    def to_frame(self) -> pd.DataFrame:
        """Table of the result.

        Raises
        ------
        MissingExtraError
            pandas is not installed.
        VpmError
            This kind of result has no table form.
        """
        columns = dict(self._frame_columns())
        with needs("pandas", "frames"):
            from pandas import DataFrame
        return DataFrame(columns)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the result to a file that `load` reads back exactly.

        Parameters
        ----------
        path : path-like
            The name is used as it is; ``.npz`` is customary.

        Returns
        -------
        pathlib.Path
            Where it was written.
        """
        arrays: dict[str, np.ndarray[Any, Any]] = {}
        header = json.dumps({"format": FORMAT, "content": _encode(self, type(self).__name__, arrays)}, allow_nan=False)
        # An open file, because savez appends .npz to names.
        with replacing(path) as beside, beside.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **{_HEADER: np.array(header)}, **arrays)
        return Path(path)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a result that `save` wrote.

        Raises
        ------
        VpmError
            The file is not a saved result, is of another class, or was written by a newer version.
        """
        arrays = _read_arrays(Path(path))
        try:
            document = json.loads(str(arrays.pop(_HEADER)[()]))
            version, content = int(document["format"]), document["content"]
        except _MISFIT as error:
            raise VpmError(
                f"{path} is an array file but not a saved result: its header is missing or unreadable"
            ) from error
        if version > FORMAT:
            raise VpmError(f"{path} has format {version}, and this version reads up to {FORMAT}; use a newer version")
        try:
            result = _decode(content, arrays, path)
            if isinstance(result, Result):
                # Entries that do not go together are found now, and not by the one who looks at it.
                _ = repr(result), result._repr_html_()
        except VpmError:
            raise
        except _MISFIT as error:
            raise VpmError(f"{path} does not fit this version of its class: {error}; write it anew") from error
        if not isinstance(result, cls):
            found, wanted = type(result).__name__, cls.__name__
            repair = f"use {found}.load" if isinstance(result, Result) else f"name a file that a {wanted} was saved in"
            raise VpmError(f"{path} holds a {found} in place of a {wanted}; {repair}")
        return result


def html_table(caption: str, head: tuple[str, ...], rows: list[tuple[object, ...]]) -> str:
    """HTML table of a result with escaped text; numbers are shortened."""

    def cells(tag: str, values: tuple[object, ...]) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(_plain(value))}</{tag}>" for value in values) + "</tr>"

    body = "".join(cells("td", row) for row in rows)
    top = f"<caption>{html.escape(caption)}</caption><thead>{cells('th', head)}</thead>"
    return f"<table>{top}<tbody>{body}</tbody></table>"


def _read_arrays(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    """Arrays of a stored result's .npz file; pickled objects are refused."""
    try:
        if reason := unreadable(path):
            raise VpmError(reason)
        if not path.exists():
            raise VpmError(f"{path} does not exist; check the path")
        if not zipfile.is_zipfile(path):
            raise VpmError(f"{path} is not a saved result: it is no .npz file")
        # A stream of its own, because NumPy leaves that of a broken file open.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except _BROKEN as error:
        raise VpmError(f"{path} cannot be read as a saved result: {error}") from error
    except ValueError as error:
        if isinstance(error, VpmError):
            raise
        raise VpmError(f"{path} is not a saved result: it is no .npz file of plain arrays") from error


def _field_names(value: object) -> tuple[str, ...]:
    if not is_dataclass(value):
        raise VpmError(f"{type(value).__name__} is no dataclass and does not say how it is stored")
    return tuple(field.name for field in fields(value) if field.init)


def _encode(value: object, where: str, arrays: dict[str, np.ndarray[Any, Any]]) -> object:
    """JSON form of a result's value; arrays go to `arrays` under the name of their place."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):  # JSON has no name for these
        return {_TAG: "float", "content": repr(value)}
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list):
        return [_encode(item, f"{where}.{i}", arrays) for i, item in enumerate(value)]
    tag, content = _encode_container(value, where, arrays)
    return {_TAG: tag, "content": content}


def _encode_container(value: object, where: str, arrays: dict[str, np.ndarray[Any, Any]]) -> tuple[str, object]:
    """Tag and JSON content of a result's array, tuple, mapping or storable object."""
    match value:
        case np.ndarray():
            if value.dtype.kind not in "biufcU":
                raise VpmError(f"{where} cannot be stored: it is an array of {value.dtype}, not of numbers or text")
            # The number keeps names apart; the place is for people who look into the file.
            name = f"{len(arrays)}_{re.sub(r'[^A-Za-z0-9_.-]', '_', where)[:80]}"
            arrays[name] = value
            return "array", name
        case tuple():
            return "tuple", _encode(list(value), where, arrays)
        case Mapping():
            if not all(isinstance(key, str) for key in value):
                raise VpmError(f"{where} cannot be stored: the keys of a mapping have to be text")
            return "dict", {key: _encode(item, f"{where}.{key}", arrays) for key, item in value.items()}
        case Storable():
            content = {key: _encode(item, f"{where}.{key}", arrays) for key, item in value.to_stored().items()}
            return f"object {_class_name(type(value))}", content
    raise VpmError(f"{where} cannot be stored: it is a {type(value).__name__}")


def _decode(value: object, arrays: Mapping[str, np.ndarray[Any, Any]], path: object) -> object:
    """Decode a result's value: undo `_encode`."""
    if isinstance(value, list):
        return [_decode(item, arrays, path) for item in value]
    if not isinstance(value, dict):
        return value
    tag, content = str(value.get(_TAG)), value.get("content")
    kind, _, name = tag.partition(" ")
    if kind == "array":
        return arrays[str(content)]
    if kind == "float":
        return float(str(content))
    if isinstance(content, list):
        return tuple(_decode(item, arrays, path) for item in content)
    items = {key: _decode(item, arrays, path) for key, item in dict(content or {}).items()}
    return _built(_stored_class(name, path), items, path) if kind == "object" else items


def _built(kind: type[Storable], items: Mapping[str, Any], path: object) -> Storable:
    """Result object of a stored class, whose fields are of their types."""
    built = kind.from_stored(items)
    if field := misfit(built):
        value = _short(getattr(built, field))
        raise VpmError(f"{path} does not fit its class: {kind.__name__}.{field} cannot be {value}; write it anew")
    return built


def _holds_results(module: str) -> bool:
    package, _, own = module.rpartition(".")
    return own in _MODULES.get(package, ())


def _stored_class(name: str, path: object) -> type[Storable]:
    module, _, kind = name.partition(":")
    if not _holds_results(module):
        module = present_name(module)
    if _holds_results(module):
        import_module(module)
    try:
        return _STORED_CLASSES[f"{module}:{kind}"]
    except KeyError as error:
        raise VpmError(
            f"{path} holds a {name}, which is not known here; import its class before, or use the version that wrote it"
        ) from error


def _same(left: object, right: object) -> bool:
    """Equality of content; NaN equals NaN, because it stands for "no value" in results."""
    if isinstance(left, np.ndarray) and isinstance(right, np.ndarray):
        kinds = left.dtype.kind, right.dtype.kind
        return kinds[0] == kinds[1] and np.array_equal(left, right, equal_nan=kinds[0] in "fc")
    if isinstance(left, np.ndarray) or isinstance(right, np.ndarray):
        return False
    if isinstance(left, Mapping) and isinstance(right, Mapping):
        return left.keys() == right.keys() and all(_same(left[key], right[key]) for key in left)
    if isinstance(left, tuple | list) and isinstance(right, tuple | list):
        return type(left) is type(right) and len(left) == len(right) and all(map(_same, left, right))
    if isinstance(left, float) and isinstance(right, float) and math.isnan(left):
        return math.isnan(right)
    return bool(left == right)


def _short(value: object) -> str:
    """One value inside a result's one-line repr."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, str):
        return repr(value) if len(value) <= 48 else repr(value[:45] + "...")
    if isinstance(value, np.ndarray):
        return f"<{' x '.join(map(str, value.shape))} array>"
    if isinstance(value, Mapping) or (isinstance(value, tuple | list) and len(value) > 6):
        return f"<{len(value)} entries>"
    if isinstance(value, tuple | list):
        inside = ", ".join(map(_short, value))
        return f"({inside})" if isinstance(value, tuple) else f"[{inside}]"
    text = repr(value)
    return text if len(text) <= 160 and "\n" not in text else f"<{type(value).__name__}>"


def _plain(value: object) -> str:
    return value if isinstance(value, str) else _short(value)
