"""A joint on a line that a cylinder closes, in time: oil in both chambers, a valve with its spool, a pump.

In each step oil flows while the joint goes half its way, the joint gets its new speed from the forces in the middle
(`plant.py`), and oil flows along the other half (G. Strang, 1968): of second order. With a shut valve the pressure of
oil without air is a function of the place alone, so that no energy is made. A joint that sticks squeezes no oil.

Into a chamber flows, through an edge open by u to supply or tank, or past the piston, as far as it is not made room::

    p' = beta_e / V (q - V')       q = gain |u| root(p_end - p)      1 / beta_e = (1 / beta + a / (n p)) / (1 + a)

with air a = r (p0 / p)^(1 / n) per oil (H. Merritt, Hydraulic Control Systems, 1967, sections 1-3, 3-3 and 3-5). Around
no drop the root is a cubic with a finite slope (A. Ellman and R. Piche, 1999). Pressures are absolute.
"""

from collections.abc import Sequence

import numpy as np
from scipy.linalg import expm

from second_suite.machine import Array, Machine, Values
from second_suite.plant import Hidden, Plant

#: Drop at which flow through an edge becomes turbulent, and pressure below which oil boils [Pa].
TURBULENT, VAPOUR = 1e4, 2e3
#: Of air in oil: pressure at which its share is counted, polytropic exponent.
AIR_PRESSURE, AIR_EXPONENT = 101325.0, 1.4
#: Pressure on the side of the rod before a record [Pa].
AT_REST = 1.5e6


def root(drop: Array) -> Array:
    """Signed square root of a pressure drop."""
    size = np.abs(drop)
    turbulent = np.maximum(size, TURBULENT)
    rooted: Array = drop / np.sqrt(turbulent) * (1.5 - 0.5 * np.minimum(size / TURBULENT, 1.0))
    return rooted


class Spool:
    """z'' = w^2 (u - z) - 2 D w z', solved exactly for a command that is held over a step."""

    def __init__(self, frequency: Array, damping: Array, stroke: Array, step: float) -> None:
        self.stroke = stroke
        self.away, self.opening = np.zeros((2, len(frequency))), np.zeros(len(frequency))
        pairs = zip(frequency, damping, strict=True)
        self.turn = np.stack([expm(step * np.array([[0.0, 1.0], [-w * w, -2.0 * d * w]])) for w, d in pairs], axis=2)

    def mean_opening(self, command: Array) -> Array:
        """By how much it opens the edges along one step, positive from supply to chamber a."""
        before = self.opening
        goal = np.clip(command, -self.stroke, self.stroke)
        self.away[0] -= goal
        self.away = (self.turn * self.away).sum(axis=1)
        self.away[0] += goal
        self.opening = np.clip(self.away[0], -self.stroke, self.stroke)
        mean: Array = 0.5 * (before + self.opening)
        return mean


class OilPlant(Plant):
    """A machine with one joint on a cylinder; chambers are a and b, on the side of the rod."""

    def __init__(self, machine: Machine, values: Values, hidden: Sequence[Hidden], step: float) -> None:
        super().__init__(machine, values, hidden, step)
        values = self.values
        at = {h.effect: h.values for h in self.hidden}

        def of(effect: str, number: str) -> float:
            return at.get(effect, {}).get(number, 0.0)

        #: Volume per way of the piston, and force on it per pressure; volumes of the piston drawn in.
        self.area = values["piston.area"] * np.stack([np.ones(self.columns), -values["piston.ratio"]])
        self.shut = np.stack([values["lines.a"], values["lines.b"] - self.area[1] * values["piston.stroke"]])
        self.ends = np.stack([values["pump.pressure"], values["pump.tank"]])
        self.gains = np.stack([values["valve.gain"], values["valve.gain"] * (1.0 - of("uneven_edges", "less"))])
        frequency = 1.0 / (1.0 / values["valve.frequency"] + of("valve_dynamics", "time"))
        self.spool = Spool(frequency, values["valve.damping"], values["valve.stroke"], 0.5 * step)
        self.leak = of("internal_leakage", "coefficient")
        self.air = of("entrained_air", "fraction")
        self.pressing = of("seal_friction", "share") * values["piston.area"]
        self.resistance, self.late = of("supply_drop", "resistance"), of("supply_drop", "time_constant")
        self.p = np.zeros((2, self.columns))
        self.drop = np.zeros(self.columns)
        self.volume = np.ones_like(self.p)
        self.lever = np.zeros(self.columns)
        self.opening = np.zeros(self.columns)

    def start(self, place: Array) -> None:
        """Stand still on oil that carries the load."""
        super().start(place)
        self._place(self.q[0])
        _, load = self.mass_and_load(self.q, self.v)
        push = -self.forces(self.q, self.v, np.zeros_like(self.q), load)[0] / self.lever
        self.p[1] = AT_REST
        self.p[0] = (push - self.area[1] * AT_REST) / self.area[0]

    def pressures(self) -> Array:
        """Of both chambers now."""
        return np.maximum(self.p, VAPOUR)

    def advance(self, effort: Array) -> None:
        """One step under a command of the valve, which stands in the place of an effort."""
        self._follow(self.q[0] + 0.5 * self.step * self.v[0], effort[0])
        push = (self.area * np.maximum(self.p, VAPOUR)).sum(axis=0)
        rub = self.values["seals.viscous"] * self.lever * (self.v[0] + 0.5 * self.rate_before[0])
        super().advance((self.lever * (push - rub))[None])
        self._follow(self.q[0], effort[0])

    def limits(self, q: Array, v: Array, effort: Array) -> dict[int, tuple[Array, Array]]:
        """Dry friction of the pin, and of the seals along the line."""
        found = super().limits(q, v, effort)
        seals = self.values["seals.coulomb"] + self.pressing * np.maximum(self.p, VAPOUR).sum(axis=0)
        torque = seals * np.abs(self.lever)
        up, down = found.get(0, (0.0, 0.0))
        found[0] = (up + torque, down + torque)
        return found

    def _place(self, q: Array) -> Array:
        """Lever and volumes of a place; the logarithm of what the volumes grew."""
        assert self.machine.line is not None
        length, self.lever = self.machine.line(self.values, q)
        before = self.volume
        self.volume = self.shut + self.area * (length - self.values["piston.retracted"])
        return np.log(self.volume / before)

    def _follow(self, q: Array, command: Array) -> None:
        """Oil follows the spool and the joint to a place, over half a step (explicit midpoint)."""
        time, before = 0.5 * self.step, self.volume
        self.opening = self.spool.mean_opening(command)
        flow, rate = self._flow(self.p, self.drop)
        grown = self._place(q)
        middle = self.p + 0.5 * self._modulus(self.p) * (time * flow / before - grown)
        flow, rate = self._flow(middle, self.drop + 0.5 * time * rate)
        volume = 0.5 * (before + self.volume)
        self.p = self.p + self._modulus(middle) * (time * flow / volume - grown)
        self.drop = self.drop + time * rate

    def _flow(self, p: Array, drop: Array) -> tuple[Array, Array]:
        """Into both chambers, and how fast the drop between pump and valve changes."""
        held, up = np.maximum(p, VAPOUR), self.opening > 0.0
        ends, rate = self.ends, drop
        if self.resistance:
            ends = ends - np.stack([drop, np.zeros_like(drop)])
        far = np.where(up, ends, ends[::-1])
        flow = np.where(up, self.gains, self.gains[::-1]) * np.abs(self.opening) * root(far - held)
        if self.resistance:
            rate = (self.resistance * np.where(up, flow[0], flow[1]) - drop) / self.late
        if self.leak:
            past = self.leak * (held[0] - held[1])
            flow = flow + np.stack([-past, past])
        return flow, rate

    def _modulus(self, p: Array) -> Array:
        """Of oil with its air."""
        modulus = self.values["oil.modulus"]
        if not self.air:
            return modulus
        held = np.maximum(p, VAPOUR)
        air = self.air * (AIR_PRESSURE / held) ** (1.0 / AIR_EXPONENT)
        mixed: Array = (1.0 + air) / (1.0 / modulus + air / (AIR_EXPONENT * held))
        return np.where(p > VAPOUR, mixed, modulus)
