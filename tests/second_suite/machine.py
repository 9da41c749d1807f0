"""What a machine has to say of itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = Mapping[str, Array]
#: Mass matrix (columns, n, n), and loads h of M a + h = effort (n, columns), of the machine without rotors and losses.
Tree = Callable[[Values, Array, Array], tuple[Array, Array]]
#: Length of a line that a cylinder closes, and its lever: what the length gains per coordinate.
Line = Callable[[Values, Array], tuple[Array, Array]]
#: From (sample, readings, their rates, references with two derivatives) to commands; arrays (n, columns).
Law = Callable[[int, Array, Array, Array], Array]
Range = tuple[float, float]


@dataclass(frozen=True)
class Joint:
    """A joint with its drive and its encoder, if it has them."""

    name: str
    #: "" for none.
    drive: str = ""
    encoder: str = ""
    gain: float = 1.0  #: Effort per command.
    #: Of the encoder (SI).
    noise: float = 0.0
    resolution: float = 0.0
    drive_noise: float = 0.0  #: Standard deviation of what the drive adds unseen from sample to sample, in A.
    prismatic: bool = False  #: Logged in mm, else in degrees.
    #: Of a tachometer, if there is one: unit in the log, SI per unit, noise (SI).
    speed_unit: str = ""
    per_speed_unit: float = 1.0
    speed_noise: float = 0.0
    command_unit: str = "A"  #: Of the drive.

    @property
    def channel(self) -> str:
        """Under which positions are logged."""
        return f"{self.name}.position"

    @property
    def unit(self) -> str:
        """In which positions are logged."""
        return "mm" if self.prismatic else "deg"

    @property
    def per_unit(self) -> float:
        """SI per unit of a logged position."""
        return 1e-3 if self.prismatic else np.pi / 180.0


@dataclass(frozen=True)
class PressureGauge:
    """A gauge of the pressure in a chamber: its name, what it reads, noise and resolution (Pa)."""

    name: str
    channel: str
    noise: float
    resolution: float
    unit: str = "bar"
    per_unit: float = 1e5


@dataclass(frozen=True)
class Choice:
    """An effect at one site with the ranges of its numbers.

    ``base`` names the machine's own number that the model file leaves out; without it the effect is something more.
    """

    effect: str
    site: str
    ranges: Mapping[str, Range] = field(default_factory=dict)
    base: str = ""


@dataclass(frozen=True)
class Machine:
    """A machine."""

    name: str
    joints: tuple[Joint, ...]  #: In the order of the coordinates.
    #: Samples per second, and steps of the simulation from one to the next.
    rate: float
    substeps: int
    lengths: tuple[float, ...]  #: Of the records [s]; the last one judges.
    #: True numbers of the textbook machine; ``JOINT.coulomb``, ``JOINT.viscous`` and ``JOINT.rotor`` are known
    #: here.
    values: Mapping[str, float]
    adjustable: Mapping[str, float]  #: Those that the model file gives an uncertainty, relative to the value.
    tree: Tree
    law: Callable[[Machine, int], Law]  #: Makes the controller: from the machine and how many columns.
    #: References of one record: from generator, time, and the number of the record to (samples, n).
    motion: Callable[[np.random.Generator, Array, int], Array]
    #: The model file as a dict, from a function that writes a number by its name, and from the names left out.
    document: Callable[[Callable[[str], object], frozenset[str]], dict[str, object]]
    #: What can be hidden.
    choices: tuple[Choice, ...]
    outside: tuple[Choice, ...] = ()
    pairs: tuple[tuple[tuple[str, str], ...], ...] = ()
    #: Commands beside the controller: likewise, to (samples, n), and whether the controller is switched off.
    torque: Callable[[np.random.Generator, Array, int], tuple[Array, bool]] | None = None
    friction_at_load: bool = True  #: Whether dry and viscous friction sits behind a soft or loose gear.
    latency: int = 0  #: Samples from a reading to the command that it makes.
    #: Whether the model file has the controller, and the log its references and what is added to its commands.
    known_loop: bool = False
    same: tuple[tuple[tuple[str, str], tuple[str, str]], ...] = ()  #: Pairs of answers that are one physics here.
    #: Where the coordinates stand at first, from the values and the first references (n, columns).
    rest: Callable[[Values, Array], Array] | None = None
    #: Of a machine whose only joint is moved by a cylinder: the line that the cylinder closes.
    line: Line | None = None
    gauges: tuple[PressureGauge, ...] = ()  #: Of the chambers a and b of that cylinder.

    @property
    def driven(self) -> tuple[int, ...]:
        """Coordinates with a drive."""
        return tuple(i for i, joint in enumerate(self.joints) if joint.drive)

    @property
    def measured(self) -> tuple[int, ...]:
        """Coordinates with an encoder."""
        return tuple(i for i, joint in enumerate(self.joints) if joint.encoder)

    def joint_of(self, site: str) -> int | None:
        """The coordinate that a joint, a drive or an encoder belongs to; None for bodies and the world."""
        return next((i for i, j in enumerate(self.joints) if site and site in {j.name, j.drive, j.encoder}), None)

    def index(self, site: str) -> int:
        """The same of a site that has one."""
        found = self.joint_of(site)
        if found is None:
            raise KeyError(site)
        return found


def columns_of(values: Mapping[str, float], count: int) -> dict[str, Array]:
    """One column of numbers for each simulation side by side."""
    return {name: np.full(count, value) for name, value in values.items()}


def uneven(site: str, up: tuple[Range, Range], down: tuple[Range, Range]) -> Choice:
    """Dry and viscous friction that is not the same in both directions."""
    ranges = {"coulomb_up": up[0], "coulomb_down": down[0], "viscous_up": up[1], "viscous_down": down[1]}
    return Choice("asymmetric_friction", site, ranges)


def drawn(rng: np.random.Generator, ranges: Mapping[str, Range]) -> dict[str, float]:
    """Numbers of an effect: between their bounds, by factors where those have one sign."""
    numbers = {}
    for name, (low, high) in ranges.items():
        if low > 0.0:
            numbers[name] = float(np.exp(rng.uniform(np.log(low), np.log(high))))
        else:
            numbers[name] = float(rng.uniform(low, high))
    return numbers


def below(number: object) -> object:
    """A number of a model file for what hangs below a joint: files count heights upward."""
    if isinstance(number, dict):
        return {**number, "value": -number["value"]}
    return -float(str(number))


def loss_entries(
    number: Callable[[str], object], without: frozenset[str], joints: Sequence[str], viscous_only: Sequence[str] = ()
) -> list[dict[str, object]]:
    """Entries of a model file for the friction that the machine is known to have."""
    entries: list[dict[str, object]] = []
    for name in (*joints, *viscous_only):
        if name in joints and f"{name}.coulomb" not in without:
            entries.append({"type": "coulomb_friction", "at": name, "coulomb": number(f"{name}.coulomb")})
        if f"{name}.viscous" not in without:
            entries.append({"type": "viscous_friction", "at": name, "viscous": number(f"{name}.viscous")})
    return entries
