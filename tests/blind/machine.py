"""What a machine of the proving ground has to say of itself, and what it draws for one case."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from blind.effects import Scale
from blind.loads import Column
from blind.loop import Controller, Plant

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Draft:
    """One example of a machine, without a hidden effect."""

    values: Mapping[str, float]  #: Everything that is true of it, as ``site.name`` or ``site.effect.parameter``.
    #: Relative uncertainty of what the model file leaves to be calibrated, by the same keys.
    calibratable: Mapping[str, float]
    base: tuple[tuple[str, str], ...]  #: Effects that the model file knows.
    scales: Mapping[str, Scale]  #: What is usual at a site.
    rate: float  #: Sampling rate [Hz].


@dataclass(frozen=True)
class Signal:
    """A logged signal: name of the sensor or actuator, channel of the record, unit, column of a file."""

    name: str
    channel: str
    unit: str


@dataclass(frozen=True)
class Layout:
    """Signals and sites of a machine."""

    #: The first sensors are those that the controllers see, one for each actuator.
    sensors: tuple[Signal, ...]
    commands: tuple[Signal, ...]
    references: tuple[Signal, ...]
    sites: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  #: Sites of each kind.
    without: tuple[str, ...] = ()  #: Effects that make no sense on the machine.
    #: Parameters that an effect has where it is not there, other than zero.
    absent: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


class Machine(Protocol):
    """One machine: draws examples of itself, describes them as model files, and moves."""

    @property
    def name(self) -> str:
        """Name in the proving ground."""

    @property
    def layout(self) -> Layout:
        """Signals and sites."""

    @property
    def step(self) -> float:
        """Fine time step [s]."""

    def draft(self, generator: Generator, needs: Sequence[str]) -> Draft:
        """An example that has the base effects ``needs``, as ``effect@site``."""

    def text(self, values: Mapping[str, float], draft: Draft, base: Sequence[tuple[str, str]]) -> str:
        """Model file with these values of the nominal parameters and these known effects."""

    def plant(self, columns: Sequence[Column], step: float) -> Plant:
        """The machine in continuous time, many columns side by side."""

    def controller(self, columns: Sequence[Column], dt: float) -> Controller:
        """What commands its drives."""

    def mixed(self, values: Mapping[str, float]) -> Mapping[str, Mapping[str, float]]:
        """Weighted sums of channels that say more than each of them, such as the force of a cylinder."""

    def reference(self, generator: Generator, draft: Draft, time: Array, kind: str) -> Array:
        """References of a record of the kind ``"train"`` or ``"validate"``, shape (actuators, samples)."""


def rub(
    joint: str,
    coulomb: float | None,
    values: dict[str, float],
    calibratable: dict[str, float],
    base: list[tuple[str, str]],
) -> None:
    """Note the frictions that the model file knows at a joint: viscous, and Coulomb's if it has any."""
    base.append(("viscous_friction", joint))
    if coulomb is not None:
        base.append(("coulomb_friction", joint))
        values[f"{joint}.coulomb_friction.coulomb"] = coulomb
        calibratable[f"{joint}.coulomb_friction.coulomb"] = 0.2


def number(value: float, unit: str, deviation: float | None = None) -> str:
    """A parameter of a model file; one with a deviation may be calibrated."""
    if deviation is None:
        return f'{{ value = {value!r}, unit = "{unit}" }}'
    return f'{{ value = {value!r}, unit = "{unit}", uncertainty = {deviation!r} }}'


class Writer:
    """Values as a model file shows them: with an uncertainty where they may be calibrated."""

    def __init__(self, values: Mapping[str, float], calibratable: Mapping[str, float]) -> None:
        self.values, self.calibratable = values, calibratable

    def __call__(self, key: str, unit: str) -> str:
        value = float(self.values[key])
        share = self.calibratable.get(key)
        return number(value, unit, None if share is None else share * abs(value))

    def motor(self, drive: str, joint: str, unit: str, command: str) -> str:
        """Table of a drive whose effort is proportional to its command."""
        gain = self(f"{drive}.gain", f"{unit}/{command}")
        return f'[actuators.{drive}]\njoint = "{joint}"\ngain = {gain}\ncommand_unit = "{command}"'

    def cylinder(self, drive: str, stroke: float) -> str:
        """Tables of the valve and the cylinder of a hydraulic drive."""
        return f"""[actuators.{drive}.valve]
flow_gain = {self(f"{drive}.flow_gain", "m^3/(s A Pa^0.5)")}
frequency = {{ value = 250.0, unit = "rev/s" }}
damping = 0.7
stroke = {self(f"{drive}.limit", "A")}

[actuators.{drive}.cylinder]
bore = {{ value = 16.0, unit = "mm" }}
rod = {{ value = 10.0, unit = "mm" }}
stroke = {stroke!r}
line_a = {self(f"{drive}.line_a", "m^3")}
line_b = {self(f"{drive}.line_b", "m^3")}"""

    def pump(self) -> str:
        """Table of a supply."""
        return f"""[supplies.pump]
pressure = {self("pump.pressure", "Pa")}
tank_pressure = {self("pump.tank", "Pa")}
oil = {{ bulk_modulus = {self("pump.modulus", "Pa")} }}"""

    def cascade(self, servo: str, drive: str, joint: str, command: str, coordinate: str) -> str:
        """Table of a controller of place and speed."""
        return f"""[controllers.{servo}]
type = "cascade"
actuator = "{drive}"
measures = "{joint}.position"
position_gain = {self(f"{servo}.position_gain", "1/s")}
velocity_gain = {self(f"{servo}.velocity_gain", f"{command} s/{coordinate}")}
limit = {self(f"{servo}.limit", command)}"""

    def effects(self, base: Sequence[tuple[str, str]], kinds: Mapping[str, tuple[str, str]]) -> str:
        """Tables of the known joint frictions; ``kinds`` gives the units (effort, coordinate) of each joint."""
        lines = []
        for effect, site in base:
            effort, coordinate = kinds[site]
            parameter = {"viscous_friction": "viscous", "coulomb_friction": "coulomb"}[effect]
            unit = f"{effort} s/{coordinate}" if parameter == "viscous" else effort
            lines.append(f'[[effects]]\ntype = "{effect}"\nat = "{site}"')
            lines.append(f"{parameter} = {self(f'{site}.{effect}.{parameter}', unit)}\n")
        return "\n".join(lines)
