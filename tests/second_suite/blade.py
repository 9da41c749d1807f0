"""A blade that bends, clamped to a hub that turns in a level plane, with a heavy tip: mechanics and model file.

Euler-Bernoulli: the deflection w(s) in the hub's frame is a sum of assumed modes. They are those of the clamped blade
with its nominal tip, from cubic elements. A section at s moves to (root + s - 1/2 int w'^2, w): the axis does not
stretch. Kinetic and potential energy are kept to second order in w, for any angle and speed of the hub:

    T = 1/2 (J + p'G p) rate^2 + rate b'p' + 1/2 p'M p'     G = mass of the deflection less that of the shortening
    V = 1/2 p'K p, and weight if the plane is tilted        damping is `time` K, as Kelvin and Voigt have it

G has the centrifugal stiffening and the softening by the deflection, and Coriolis terms. Left out is what is of third
order in w. Relative to the rest that is the square of the slope, which stays below 0.07.

The first coordinate is the strain at the gauge, the second the deflection at the pad, the others those of modes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from second_suite.machine import Array, Joint, Values, loss_entries

#: Points of Gauss and Legendre in each element.
POINTS = 5


@dataclass(frozen=True)
class Bridge(Joint):
    """A bridge of strain gauges, on the coordinate that is the strain there."""

    @property
    def channel(self) -> str:
        """Under which it is logged."""
        return f"{self.name}.strain"

    @property
    def unit(self) -> str:
        """In which strains are logged."""
        return "1"

    @property
    def per_unit(self) -> float:
        """SI per unit of a logged strain."""
        return 1.0


@dataclass(frozen=True)
class Part:
    """What the blade itself, or each kilogram on its tip, adds to the equations of motion; see above.

    ``first`` and ``drop`` are the static moment of the straight blade, and what a deflection takes from it; ``across``
    is the static moment of a deflection.
    """

    inertia: float
    turn: Array
    mass: Array
    spin: Array
    first: float
    drop: Array
    across: Array

    def seen_by(self, shapes: Array) -> Part:
        """The same in other coordinates, whose shapes are the columns."""
        mass, spin, drop = (shapes.T @ matrix @ shapes for matrix in (self.mass, self.spin, self.drop))
        return Part(self.inertia, shapes.T @ self.turn, mass, spin, self.first, drop, shapes.T @ self.across)


@dataclass(frozen=True)
class Blade:
    """Sizes in SI."""

    length: float
    width: float
    thickness: float
    density: float
    root: float  #: From the axis to the clamp.
    #: The mass is the one that the assumed modes are made with.
    tip_mass: float
    tip_inertia: float
    #: Arc lengths of the strain gauge, and of the place whose deflection is a coordinate.
    gauge: float
    pad: float
    modes: int = 4
    elements: int = 24

    @cached_property
    def line_density(self) -> float:
        """Mass per length."""
        return self.density * self.width * self.thickness

    @cached_property
    def moment(self) -> float:
        """Of area, of the section."""
        return self.width * self.thickness**3 / 12.0

    def shape(self, place: Array) -> Array:
        """Cubic functions, free of the clamp, with two derivatives at places: (3, places, functions)."""
        size = self.length / self.elements
        element = np.clip((place / size).astype(int), 0, self.elements - 1)
        x = place / size - element
        one = np.ones_like(x)
        values = [1 - 3 * x**2 + 2 * x**3, size * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, size * (x**3 - x**2)]
        slopes = [6 * x**2 - 6 * x, size * (1 - 4 * x + 3 * x**2), 6 * x - 6 * x**2, size * (3 * x**2 - 2 * x)]
        bends = [12 * x - 6 * one, size * (6 * x - 4 * one), 6 * one - 12 * x, size * (6 * x - 2 * one)]
        table = np.zeros((3, len(place), 2 * self.elements + 2))
        for order, parts in enumerate((values, slopes, bends)):
            for k, part in enumerate(parts):
                table[order, np.arange(len(place)), 2 * element + k] = part / size**order
        return table[:, :, 2:]

    @cached_property
    def elastic(self) -> tuple[Part, Part, Array]:
        """Of the blade with the tip's own inertia, of each kilogram on the tip, and stiffness per modulus."""
        knots, weights = np.polynomial.legendre.leggauss(POINTS)
        size = self.length / self.elements
        s = np.add.outer(size * np.arange(self.elements), 0.5 * size * (knots + 1.0)).ravel()
        ds = np.tile(0.5 * size * weights, self.elements)
        w, slope, bend = self.shape(s)
        end, end_slope, _ = self.shape(np.array([self.length]))[:, 0]
        line, turned, far = self.line_density, self.density * self.moment, self.root + self.length

        def summed(weight: Array | float, left: Array, right: Array) -> Array:
            return np.asarray(left.T @ (right * (weight * ds)[:, None]))

        # What is carried beyond a section: its moment about the axis, and its mass.
        beyond = line * (self.length - s) * (self.root + 0.5 * (self.length + s))
        moved = summed(line, w, w)
        own = Part(
            inertia=float(line * (far**3 - self.root**3) / 3.0 + turned * self.length + self.tip_inertia),
            turn=w.T @ (line * (self.root + s) * ds) + slope.T @ (turned * ds) + self.tip_inertia * end_slope,
            mass=moved + summed(turned, slope, slope) + self.tip_inertia * np.outer(end_slope, end_slope),
            spin=moved - summed(beyond, slope, slope),
            first=line * self.length * (self.root + 0.5 * self.length),
            drop=summed(line * (self.length - s), slope, slope),
            across=w.T @ (line * ds),
        )
        shortening = summed(1.0, slope, slope)
        moved = np.outer(end, end)
        tip = Part(far**2, far * end, moved, moved - far * shortening, far, shortening, end)
        return own, tip, summed(self.moment, bend, bend)

    @cached_property
    def shapes(self) -> Array:
        """Assumed modes, made to coordinates of which the first is the strain and the second the pad's deflection."""
        own, tip, stiffness = self.elastic
        root = np.linalg.cholesky(own.mass + self.tip_mass * tip.mass)
        half = np.linalg.solve(root, np.linalg.solve(root, stiffness).T)
        modes = np.linalg.solve(root.T, np.linalg.eigh(half)[1][:, : self.modes])
        named = np.eye(self.modes)
        named[0] = 0.5 * self.thickness * self.shape(np.array([self.gauge]))[2, 0] @ modes
        named[1] = self.shape(np.array([self.pad]))[0, 0] @ modes
        return np.asarray(modes @ np.linalg.inv(named))

    def tree(self) -> Callable[[Values, Array, Array], tuple[Array, Array]]:
        """Mass matrix and loads of hub and blade; see `Machine`."""
        shapes = self.shapes
        own, tip = (part.seen_by(shapes) for part in self.elastic[:2])
        stiffness = shapes.T @ self.elastic[2] @ shapes

        def equations(values: Values, q: Array, v: Array) -> tuple[Array, Array]:
            weight = values["tip.mass"] + values.get("payload", 0.0)
            p, dp, turn = q[1:], v[1:], v[0]
            pulled = own.spin @ p + weight * (tip.spin @ p)
            mass, load = np.empty((q.shape[1], len(q), len(q))), np.empty_like(q)
            mass[:, 0, 0] = values["hub.inertia"] + own.inertia + weight * tip.inertia + (p * pulled).sum(axis=0)
            mass[:, 0, 1:] = mass[:, 1:, 0] = own.turn + weight[:, None] * tip.turn
            mass[:, 1:, 1:] = own.mass + weight[:, None, None] * tip.mass
            load[0] = 2.0 * turn * (dp * pulled).sum(axis=0)
            load[1:] = values["blade.young"] * (stiffness @ (p + values["blade.damping"] * dp)) - turn**2 * pulled
            if "tilt" in values:
                load += _weight(values["tilt"], q, own, tip, weight)
            return mass, load

        return equations

    def document(
        self,
        name: str,
        level: str,
        number: Callable[[str], object],
        without: frozenset[str],
        actuators: dict[str, object],
        sensors: dict[str, object],
    ) -> dict[str, object]:
        """The model file; it has a gauge if a sensor reads it."""
        blade: dict[str, object] = {
            "parent": "hub",
            "translation": [self.root, 0.0, 0.0],
            "rotation": [0.0, 0.5 * np.pi, 0.0],
            "length": self.length,
            "level": level,
            "deforms": ["bending_x"],
            "material": {"young": number("blade.young"), "density": self.density},
            "section": {"shape": "rectangle", "width": self.width, "height": self.thickness},
        }
        if "blade.damping" not in without:
            blade["damping"] = {"stiffness": number("blade.damping")}
        slew: dict[str, object] = {"type": "revolute", "parent": "world", "child": "hub", "axis": [0.0, 0.0, 1.0]}
        if "slew.rotor" not in without:
            slew["rotor_inertia"] = number("slew.rotor")
        tip = [self.tip_inertia] * 3 + [0.0] * 3
        file: dict[str, object] = {
            "name": name,
            "gravity": [0.0, 0.0, -9.81],
            "bodies": {
                "hub": {"mass": 2.0, "inertia": [0.1, 0.1, number("hub.inertia"), 0.0, 0.0, 0.0]},
                "tip": {"mass": number("tip.mass"), "inertia": tip},
            },
            "joints": {"slew": slew, "bolts": {"type": "fixed", "parent": "blade", "child": "tip"}},
            "beams": {"blade": blade},
            "actuators": actuators,
            "sensors": sensors,
            "effects": loss_entries(number, without, ["slew"]),
        }
        # Bent towards the hub's y the blade is long on the side of -y.
        gauges = {"root": {"beam": "blade", "at": self.gauge, "y": -0.5 * self.thickness}}
        return file | ({"gauges": gauges} if "bridge" in sensors else {})


def _weight(tilt: Array, q: Array, own: Part, tip: Part, more: Array) -> Array:
    """Loads by weight in the plane, which a tilt about y of the world gives."""
    pull, p, out = -9.81 * np.sin(tilt), q[1:], np.empty_like(q)
    dropped, across = own.drop @ p + more * (tip.drop @ p), own.across[:, None] + more * tip.across[:, None]
    first = own.first + more * tip.first - 0.5 * (p * dropped).sum(axis=0)
    out[0] = pull * (np.sin(q[0]) * first + np.cos(q[0]) * (across * p).sum(axis=0))
    out[1:] = pull * (np.cos(q[0]) * dropped + np.sin(q[0]) * across)
    return out
