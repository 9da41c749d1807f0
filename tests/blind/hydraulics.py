"""Servovalves and cylinders on one pump, many cases side by side: oil, edges, spools, a supply that sags.

Equations: D'Imperio (2016), section 4.1 with the signs of the balances of volume corrected; the modulus of oil with air
by its polytropic compression. The spool is stepped exactly, the chambers by half a step, then by a whole one with what
is known in the middle; with the leapfrog of the mechanics in between, the oil's vibration neither grows nor fades.

Arrays have the shape (cylinders, columns); a spool is counted in the unit of the command.
"""

from collections.abc import Sequence

import numpy as np

from blind.loads import Array, Column, clip, stack

#: Drop around which the flow through an edge turns from laminar to turbulent [Pa].
LAMINAR = 1e4
#: Contact of the piston with the ends of its stroke [N/m, N s/m].
STOP_STIFFNESS, STOP_DAMPING = 1e8, 1e4
AIR_PRESSURE, AIR_EXPONENT = 101325.0, 1.4


def root(drop: Array) -> Array:
    """Signed square root of a pressure drop, with a finite slope at none."""
    return np.asarray(drop / np.sqrt(np.sqrt(drop * drop + (0.3 * LAMINAR) ** 2)))


class Cylinders:
    """Cylinders behind servovalves; ``supply`` names the pump in the columns."""

    def __init__(self, names: Sequence[str], columns: Sequence[Column], supply: str, step: float) -> None:
        def get(name: str, default: float = 0.0) -> Array:
            return stack(columns, names, name, default)

        def pump(name: str, default: float = 0.0) -> Array:
            return stack(columns, [supply], name, default)

        self.step = step
        self.area, self.ratio, self.stroke = get("area"), get("ratio"), get("stroke")
        self.line_a, self.line_b = get("line_a"), get("line_b")
        self.gain, self.limit = get("flow_gain"), get("limit")
        self.leak = get("internal_leakage.coefficient")
        self.ps0, self.pt = pump("pressure"), pump("tank")
        self.modulus, self.air = pump("modulus"), pump("entrained_air.fraction")
        self.resistance = pump("supply_drop.resistance")
        self.capacitance = pump("supply_drop.capacitance", 1.0)
        self.sags, self.airy = bool(self.resistance.any()), bool(self.air.any())
        self.safe_resistance = np.where(self.resistance > 0.0, self.resistance, 1.0)
        self.pb = (self.ps0 + self.pt) / (1.0 + self.ratio)
        self.pa = self.ratio * self.pb
        self.ps = self.ps0.copy()
        self.z, self.rate = np.zeros_like(self.area), np.zeros_like(self.area)
        frequency = 2.0 * np.pi * np.array([
            [c.get(f"{n}.valve_dynamics.frequency", c.get(f"{n}.frequency", 250.0)) for c in columns] for n in names
        ])  # fmt: skip
        self._spool(frequency, get("damping", 0.7), 0.5 * step)
        self._middle = (self.pa, self.pb, self.ps)

    def _spool(self, frequency: Array, damping: Array, h: float) -> None:
        """Exact transition of z'' = w^2 (u - z) - 2 D w z' over half a step, for D < 1."""
        fade, turn = np.exp(-damping * frequency * h), frequency * np.sqrt(1.0 - damping**2)
        cosine, sine = np.cos(turn * h), np.sin(turn * h) / turn
        self._zz, self._zr = fade * (cosine + damping * frequency * sine), fade * sine
        self._rz, self._rr = -fade * frequency**2 * sine, fade * (cosine - damping * frequency * sine)

    def _move_spool(self, command: Array) -> Array:
        away, rate = self.z - command, self.rate
        self.z = command + self._zz * away + self._zr * rate
        self.rate = self._rz * away + self._rr * rate
        return clip(self.z, -self.limit, self.limit)

    def start(self, force: Array) -> None:
        """Chambers at rest with a net force, around the pressures of no net force."""
        share = force / (self.area * (1.0 + self.ratio))
        self.pa, self.pb = self.pa + share, self.pb - share

    def _bulk(self, pressure: Array) -> Array:
        if not self.airy:
            return self.modulus
        pressure = np.maximum(pressure, 2000.0)
        air = self.air * (AIR_PRESSURE / pressure) ** (1.0 / AIR_EXPONENT)
        return np.asarray(self.modulus * (1.0 + air) / (1.0 + air * self.modulus / (AIR_EXPONENT * pressure)))

    def _rates(
        self, z: Array, x: Array, v: Array, pressures: tuple[Array, Array, Array]
    ) -> tuple[Array, Array, Array | None]:
        """Time derivatives of the pressures; x is counted from mid-stroke."""
        pa, pb, ps = pressures
        out = z > 0.0
        qa = self.gain * z * root(np.where(out, ps - pa, pa - self.pt))
        qb = self.gain * z * root(np.where(out, pb - self.pt, ps - pb))
        leak = self.leak * (pa - pb)
        small = self.ratio * self.area
        va = self.line_a + self.area * np.maximum(0.5 * self.stroke + x, 0.0)
        vb = self.line_b + small * np.maximum(0.5 * self.stroke - x, 0.0)
        da = self._bulk(pa) / va * (qa - self.area * v - leak)
        db = self._bulk(pb) / vb * (small * v + leak - qb)
        if not self.sags:
            return da, db, None
        drawn = np.where(out, qa, -qb).sum(0, keepdims=True)
        sag = ((self.ps0 - ps) / self.safe_resistance - drawn) / self.capacitance
        return da, db, np.where(self.resistance > 0.0, sag, 0.0)

    def _gone_on(self, rates: tuple[Array, Array, Array | None], h: float) -> tuple[Array, Array, Array]:
        da, db, ds = rates
        return self.pa + h * da, self.pb + h * db, self.ps if ds is None else self.ps + h * ds

    def middle_force(self, command: Array, x: Array, v: Array) -> Array:
        """Force in the middle of the step that begins at x and v."""
        z = clip(self.z, -self.limit, self.limit)
        self._command = clip(command, -self.limit, self.limit)
        self._middle = self._gone_on(self._rates(z, x, v, (self.pa, self.pb, self.ps)), 0.5 * self.step)
        pa, pb, _ = self._middle
        beyond = x - clip(x, -0.5 * self.stroke, 0.5 * self.stroke)
        stop = np.where(beyond != 0.0, STOP_STIFFNESS * beyond + STOP_DAMPING * v, 0.0)
        return np.asarray(self.area * (pa - self.ratio * pb) - np.where(stop * beyond > 0.0, stop, 0.0))

    def finish(self, x: Array, v: Array) -> None:
        """Step the chambers with place and speed in the middle."""
        z = self._move_spool(self._command)
        rates = self._rates(z, x, v, self._middle)
        self.pa, self.pb, self.ps = self._gone_on(rates, self.step)
        self._move_spool(self._command)

    @property
    def pressure_sum(self) -> Array:
        """Sum of both pressures in the middle of the step, which presses on the seals."""
        return self._middle[0] + self._middle[1]
