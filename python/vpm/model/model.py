"""The model of a machine, immutable: every change gives a new one that was checked like a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn, Self, overload

import numpy as np
from numpy.typing import NDArray

from vpm.catalogue import SITE_KINDS, Side, effect_type
from vpm.errors import CoreError, ModelError, near_match
from vpm.files import write_text
from vpm.model.check import check_document, check_effect
from vpm.model.checked_document import Checked
from vpm.model.compile import core_of, described, structure_text
from vpm.model.effect_start import starting_values
from vpm.model.effects import Effect, effects_of
from vpm.model.evaluation import Evaluations
from vpm.model.parameters import Parameter
from vpm.model.reading import parse_toml, read_toml
from vpm.model.splitting import name_behind, name_of_bending, spring_in_series
from vpm.model.writer import content_of, toml_of
from vpm.numbers import number_of
from vpm.results import Storable, html_table

if TYPE_CHECKING:
    from vpm._core import System


#: What a model keeps of its own values; the rest of what it keeps holds for all models of the same structure.
_OF_VALUES = frozenset({"_checked", "_path", "_content", "parameters", "theta", "dynamics", "loops"})


class Model(Evaluations, Storable):
    """A machine: bodies, joints, beams, actuators, sensors, controllers and effects, with one flat table of parameters.

    Build it with `load`, `from_toml` or `from_dict`. Numbers that go in and out are SI; the units of a file are
    converted when it is read.

    Examples
    --------
    >>> model = Model.load("examples/emps/model.toml")
    >>> stiffer = model.with_parameters({"axis.friction.viscous": 250.0})
    >>> rougher = model.with_effect("coulomb_friction", at="axis", coulomb=20.0)
    """

    _checked: Checked
    _path: str | None

    def __init__(self, content: Mapping[str, object], *, path: str | None = None) -> None:
        self.__dict__["_checked"] = check_document(content, path)
        self.__dict__["_path"] = path

    def __setattr__(self, name: str, value: object) -> NoReturn:
        raise AttributeError(f"a model does not change, so {name} cannot be set; use with_parameters or with_effect")

    def __delattr__(self, name: str) -> NoReturn:
        raise AttributeError(f"a model does not change, so {name} cannot be deleted")

    # ---- ways in and out ---------------------------------------------------------------------------------------------

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a model file.

        Parameters
        ----------
        path : path-like
            TOML file.

        Raises
        ------
        ModelError
            The file cannot be read, or describes no machine; one sentence with the place, the numbers and the repair.
        """
        return cls(read_toml(path), path=str(path))

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Read a model from the text of a model file.

        Raises
        ------
        ModelError
            As `load`.
        """
        return cls(parse_toml(text))

    @classmethod
    def from_dict(cls, content: Mapping[str, object]) -> Self:
        """Build a model from content as a TOML parser gives it.

        Raises
        ------
        ModelError
            As `load`.
        """
        return cls(content)

    def to_dict(self) -> dict[str, Any]:
        """Content of the model that `from_dict` reads back; a copy."""
        return content_of(self._checked.document)

    def to_toml(self, remarks: Mapping[tuple[str, ...], str] = MappingProxyType({}), head: Sequence[str] = ()) -> str:
        """Text of a model file that reads back as an equal model; comments of the original are not kept.

        Parameters
        ----------
        remarks : mapping of tuple of str to str
            Comments by place: ``("bodies", "arm")`` above a table, ``("bodies", "arm", "mass")`` behind a line.
        head : sequence of str
            Lines of a comment above all.
        """
        return toml_of(self._checked.document, remarks, head)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write a model file.

        Returns
        -------
        pathlib.Path
            Where it was written.
        """
        return write_text(path, self.to_toml())

    @property
    def path(self) -> str | None:
        """File that the model was read from; None if it came another way or was changed since."""
        return self._path

    @property
    def gravity(self) -> tuple[float, float, float]:
        """Gravity of the model in the world frame (m/s^2)."""
        x, y, z = self._checked.document.gravity
        return (x, y, z)

    # ---- parameters --------------------------------------------------------------------------------------------------

    @cached_property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters of the model by dotted name, in index order."""
        return MappingProxyType(self._checked.parameters)

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Dotted names of the model's parameters, in index order."""
        return tuple(self.parameters)

    @cached_property
    def adjustable(self) -> tuple[str, ...]:
        """Names of the model's parameters that a fit may change by default, in index order."""
        return tuple(name for name, parameter in self.parameters.items() if parameter.adjustable)

    @cached_property
    def theta(self) -> NDArray[np.float64]:
        """Values of all parameters of the model (SI), shape (P,); read-only."""
        values = np.array([parameter.value for parameter in self.parameters.values()], dtype=np.float64)
        values.flags.writeable = False
        return values

    def index(self, name: str) -> int:
        """Index of a parameter in the model's `theta`.

        Raises
        ------
        ModelError
            There is no such parameter; the message names near ones.
        """
        try:
            return self._index[name]
        except KeyError:
            repair = near_match(name, self._index, what="it has")
            raise ModelError(f'{self.name} has no parameter "{name}"; {repair}', where=name) from None

    def with_parameters(self, values: Mapping[str, float]) -> Self:
        """Model with other parameter values.

        Parameters
        ----------
        values : mapping of str to float
            SI values by dotted name. A changed parameter stands in SI units in the new model's file.

        Raises
        ------
        ModelError
            A name is unknown, or a value is outside its bounds or physically impossible.
        """
        places = {self.index(name): number_of(value, name, ModelError) for name, value in values.items()}
        named = dict(zip(values, places.values(), strict=True))
        admitted = self._checked.admitted(named)
        if admitted is None:
            model = type(self)(self._checked.with_values(named).content())
            if "core" in self.__dict__:  # the core is given theta at every call: one serves all values
                model.__dict__["core"] = self.core
            return model
        theta = self.theta.copy()
        theta[list(places)] = list(places.values())
        theta.flags.writeable = False
        model = object.__new__(type(self))
        kept = {name: answer for name, answer in self.__dict__.items() if name not in _OF_VALUES}
        model.__dict__.update(kept, _checked=admitted, _path=None, theta=theta)
        return model

    # ---- effects -----------------------------------------------------------------------------------------------------

    @cached_property
    def effects(self) -> tuple[Effect, ...]:
        """Effects of the model in the order of the file."""
        return effects_of(self._checked.document)

    def effect(self, name: str, at: str, side: Side = "motor") -> Effect:
        """Effect of the model of one name at one site, on one side of a compliance or backlash there.

        Raises
        ------
        ModelError
            The model has no such effect at this site.
        """
        for effect in self.effects:
            if (effect.name, effect.at, effect.side) == (name, at, side):
                return effect
        present = ", ".join(f"{effect.name} at {effect.place}" for effect in self.effects) or "none"
        where = f'"{at}"' if side == "motor" else f'"{at}", {side} side'
        raise ModelError(f"{self.name} has no effect {name} at {where}; its effects are: {present}", where=name)

    # Two of them, so that a dictionary of values is not taken for one that may hold a side.
    @overload
    def with_effect(self, name: str, at: str, **values: float) -> Self: ...

    @overload
    def with_effect(self, name: str, at: str, *, side: Side, **values: float) -> Self: ...

    def with_effect(self, name: str, at: str, *, side: Any = "motor", **values: float) -> Self:
        """Model with one effect more.

        Parameters
        ----------
        name : str
            Effect of the catalogue.
        at : str
            Component that it sits at; ``"world"`` for a tilt of gravity.
        side : {"motor", "link"}
            Where at a joint with a compliance or backlash; names of parameters of the link side begin as ``axis.link``.
        **values : float
            SI values by short name. Sizes that are not given start where the effect does nothing, shape parameters at
            the start value of the catalogue. Sizes, and velocities and ways of friction laws that are not given, become
            adjustable, with nothing known about them beforehand.

        Raises
        ------
        ModelError
            Effect, site or parameter is unknown; the effect is already there; a value is physically impossible.
        """
        joint = self._checked.structure.turned.get(at, at)
        begun = starting_values(self, effect_type(name), at, joint, values)
        entry: dict[str, Any] = {"type": name, "at": at, "side": side, **begun}
        checked = check_effect(self._checked, entry)
        if checked is None:
            content = self.to_dict()
            content.setdefault("effects", []).append(entry)
            return type(self)(content)
        model = object.__new__(type(self))
        model.__dict__.update(_checked=checked, _path=None)
        return model

    def without_effect(self, name: str, at: str, side: Side = "motor") -> Self:
        """Model with one effect less, and without what sits in the spring that goes with it or reads its deflection.

        A play that is in series with that spring goes with it, too.

        Raises
        ------
        ModelError
            The model has no such effect at this site.
        """
        gone, content = self.effect(name, at, side), self.to_dict()
        left = [one for one in self.effects if one != gone and spring_in_series(one.type, one.at, (gone,)) is None]
        whole = gone.type.motion and not any(one.type.motion and one.at == at for one in left)
        springs = {name_of_bending(at), name_behind(at)} if whole else set()
        inside = springs & set(self.added_joints)
        sensors = content.get("sensors", {})
        inside |= {name for name, one in sensors.items() if one["measures"].partition(".")[0] in inside}
        content["sensors"] = {name: one for name, one in sensors.items() if name not in inside}
        kept = zip(self.effects, content["effects"], strict=True)
        content["effects"] = [entry for effect, entry in kept if effect in left and effect.at not in inside]
        return type(self)(content)

    def sites(self, kind: str) -> tuple[str, ...]:
        """Names of the model's components of a kind, in the order of the core.

        Parameters
        ----------
        kind : {"joint", "body", "link", "beam", "actuator", "cylinder", "supply", "sensor", "world"}
        """
        for known in SITE_KINDS:
            if kind == known:
                return self._checked.structure.sites(known)
        raise ModelError(f'effects do not sit at a "{kind}"; {near_match(kind, SITE_KINDS)}', where=kind)

    # ---- levels of detail --------------------------------------------------------------------------------------------

    def at(self, level: str | Mapping[str, str]) -> Self:
        """Model with another level of detail of its flexible links; everything else is kept, parameters as well.

        Parameters
        ----------
        level : str or mapping of str to str
            For all beams, ``"bezier(3)"``, or for those that are named, ``{"upper": "rigid"}``.

        Raises
        ------
        ModelError
            A beam or a level is unknown, a number is out of range, or a beam deforms in what the level does not know.

        Examples
        --------
        >>> stiff = model.at("rigid")
        >>> finer = model.at({"upper": "strain(5)"})
        """
        levels = dict.fromkeys(self.beams, level) if isinstance(level, str) else dict(level)
        if not self.beams:
            rest = "has no beams, so it has no level of detail; describe its flexible links under [beams]"
            raise ModelError(f"{self.name} {rest}")
        content = self.to_dict()
        for beam, text in levels.items():
            content["beams"][self._known(beam, self.beams, "beam")]["level"] = text
        return type(self)(content)

    # ---- core --------------------------------------------------------------------------------------------------------

    def description(self) -> str:
        """Description of the model for the core, as JSON text."""
        return described(self.structure, self.theta)

    @cached_property
    def structure(self) -> str:
        """The description without the values of the parameters: equal for models that differ in these only."""
        return structure_text(self._checked)

    @cached_property
    def core(self) -> System:
        """Compiled system; built once, and shared by models that differ in parameter values only.

        Raises
        ------
        ModelError
            The core refuses the description.
        """
        try:
            return core_of(self.structure, self.theta)
        except CoreError as error:
            raise ModelError(f"{self.name}: {error}") from error

    # ---- manners -----------------------------------------------------------------------------------------------------

    def __repr__(self) -> str:
        free = sum(parameter.adjustable for parameter in self.parameters.values())
        counts = [
            f"{len(items)} {what}{'' if len(items) == 1 else 's'}"
            for what, items in (
                ("joint", self.joints),
                ("beam", self.beams),
                ("actuator", self.actuators),
                ("sensor", self.sensors),
                ("controller", self.controllers),
                ("effect", self.effects),
                ("parameter", self.parameters),
            )
            if items or what != "beam"
        ]
        return f"Model({self.name!r}: {', '.join(counts)}, {free} adjustable)"

    def _repr_html_(self) -> str:
        rows: list[tuple[object, ...]] = [
            (p.name, p.value, p.unit, "known" if p.uncertainty is None else p.uncertainty, p.minimum, p.maximum)
            for p in self.parameters.values()
        ]
        return html_table(self.name, ("parameter", "value", "unit", "uncertainty", "min", "max"), rows)

    @cached_property
    def _index(self) -> Mapping[str, int]:
        return {name: i for i, name in enumerate(self.parameters)}

    @cached_property
    def _content(self) -> tuple[object, ...]:
        """What makes two models equal: units and places of a file do not, what they say does."""
        return (self.name, self.structure, tuple(self.parameters.values()), tuple(self.channel_table.items()))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Model):
            return NotImplemented
        return self._content == other._content

    def __hash__(self) -> int:
        return hash((self.name, self.structure, (self.theta + 0.0).tobytes()))  # minus zero is zero

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuild, (type(self), self.to_dict(), self.path)

    def to_stored(self) -> Mapping[str, object]:
        """Content of the model as text, for the files of results."""
        return {"toml": self.to_toml()}

    @classmethod
    def from_stored(cls, content: Mapping[str, Any]) -> Self:
        """Model from what `to_stored` gave."""
        return cls.from_toml(str(content["toml"]))


def _rebuild(cls: type[Model], content: dict[str, Any], path: str | None) -> Model:
    return cls(content, path=path)
