"""Linkages from TOML files: numbers with units, wrong ones refused with one sentence."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Any, NoReturn, TypeVar

from vpm.errors import ModelError, UnitError, near_match
from vpm.model.reading import read_toml
from vpm.studies.linkages.karl import Karl, KarlGeometry
from vpm.studies.linkages.leg import Leg
from vpm.studies.linkages.leg_parameters import Attachment, Cylinder, LegParameters, LegPart, Segment
from vpm.units import convert

TYPES = ("karl", "leg")
Found = TypeVar("Found")


class _Table:
    """A table of the file that remembers which keys were asked for."""

    def __init__(self, content: Mapping[str, Any], path: str, where: str = "") -> None:
        self.content, self.path, self.where = content, path, where
        self.asked: set[str] = set()

    def number(self, key: str, unit: str) -> float:
        """Load one number in SI from a table of a linkage file."""
        value = self._value(key, unit)
        if isinstance(value, list):
            self._refuse(key, f"is a list of {len(value)}, but has to be a number")
        return self._si(key, value, unit)

    def pair(self, key: str, unit: str) -> tuple[float, float]:
        """Load two numbers in SI from a table of a linkage file."""
        value = self._value(key, unit)
        if not isinstance(value, list) or len(value) != 2:
            self._refuse(key, "has to be a list of two numbers")
        return self._si(key, value[0], unit), self._si(key, value[1], unit)

    def table(self, key: str) -> _Table:
        """Load a table inside this one."""
        value = self._get(key)
        if not isinstance(value, Mapping):
            self._refuse(key, "has to be a table")
        return _Table(value, self.path, self._place(key))

    def text(self, key: str, default: str) -> str:
        """Load a text, or the default where it is missing."""
        self.asked.add(key)
        value = self.content.get(key, default)
        if not isinstance(value, str) or not value:
            self._refuse(key, "has to be text in quotes")
        return value

    def whole(self, found: Found) -> Found:
        """Give what was loaded of a table; keys that nothing asked for are refused."""
        for key in self.content:
            if key not in self.asked:
                self._refuse(key, f"is not a known key; {near_match(key, self.asked)}")
        return found

    def _value(self, key: str, unit: str) -> object:
        value = self._get(key)
        if isinstance(value, Mapping):
            inner = _Table(value, self.path, self._place(key))
            given, self._unit = inner._get("value"), inner.text("unit", unit)
            return inner.whole(given)
        self._unit = unit
        return value

    def _si(self, key: str, value: object, unit: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._refuse(key, f"is {value!r}, but has to be a number")
        try:
            return convert(float(value), self._unit, unit)
        except UnitError as error:
            self._refuse(key, f"has a wrong unit: {error}")

    def _get(self, key: str) -> object:
        self.asked.add(key)
        if key not in self.content:
            self._refuse(key, "is missing; add it")
        return self.content[key]

    def _place(self, key: str) -> str:
        return f"{self.where}.{key}" if self.where else key

    def _refuse(self, key: str, reason: str) -> NoReturn:
        where = self._place(key)
        repair = "" if ";" in reason else "; correct it"
        raise ModelError(f"{self.path}: {where} {reason}{repair}", where=where, path=self.path)


def load(path: str | PathLike[str]) -> Karl | Leg:
    """Load a linkage from a TOML file.

    Parameters
    ----------
    path : path-like
        A file with ``type = "karl"`` or ``type = "leg"``; a number is SI, or a table like
        ``{ value = 230.0, unit = "mm" }``. See ``examples/karl/karl.toml`` and ``examples/hyq_leg/leg.toml``.

    Returns
    -------
    Karl or Leg

    Raises
    ------
    ModelError
        The file cannot be read, a key is missing or unknown, a unit is wrong, or no linkage has these dimensions.
    """
    table = _Table(read_toml(path), str(path))
    kind = table.text("type", "missing")
    if kind not in TYPES:
        raise ModelError(
            f'{path}: type is "{kind}", which is no linkage; {near_match(kind, TYPES)}', where="type", path=str(path)
        )
    name = table.text("name", kind)
    try:
        return _karl(table, name) if kind == "karl" else _leg(table, name)
    except ModelError as error:
        if error.path is not None:
            raise
        raise ModelError(f"{path}: {error}", path=str(path)) from error


def _karl(table: _Table, name: str) -> Karl:
    geometry = KarlGeometry(
        medial=table.number("medial", "m"),
        distal=table.number("distal", "m"),
        stroke_direction=table.number("stroke_direction", "rad"),
        sliders=(table.pair("first_slider", "m"), table.pair("second_slider", "m")),
        ground_anchor=table.pair("ground_anchor", "m"),
        distal_anchor=table.pair("distal_anchor", "m"),
        rods=table.pair("rods", "m"),
    )
    return Karl(table.whole(geometry), name)


def _leg(table: _Table, name: str) -> Leg:
    parameters = LegParameters(
        slider_mass=table.number("slider_mass", "kg"),
        upper=_segment(table.table("upper")),
        lower=_segment(table.table("lower")),
        hip=_cylinder(table.table("hip")),
        knee=_cylinder(table.table("knee")),
        gravity=table.number("gravity", "m/s^2"),
    )
    return Leg(table.whole(parameters), name)


def _segment(table: _Table) -> Segment:
    length, mass, inertia = table.number("length", "m"), table.number("mass", "kg"), table.number("inertia", "kg m^2")
    return table.whole(Segment(length, mass, inertia, table.pair("center", "m")))


def _cylinder(table: _Table) -> Cylinder:
    units = {"base": "m", "base_angle": "rad", "tip": "m", "tip_angle": "rad"}
    attachment = Attachment(*(table.number(key, unit) for key, unit in units.items()))
    return table.whole(Cylinder(attachment, _part(table.table("barrel")), _part(table.table("rod"))))


def _part(table: _Table) -> LegPart:
    units = {"mass": "kg", "center": "m", "inertia": "kg m^2"}
    return table.whole(LegPart(*(table.number(key, unit) for key, unit in units.items())))
