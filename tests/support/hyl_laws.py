"""Laws of the HyL leg, solved without vpm: the ground under its foot, and its servo-cylinders."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Ground:
    """Normal force ``k d^n + c step(d/d_c) d'`` and friction with two speeds; eqs 3.41, 3.42 in SI."""

    stiffness: float = 2855.0 * 1000.0**1.1
    exponent: float = 1.1
    damping: float = 1000.0
    ramp: float = 1e-4
    static: float = 0.7
    dynamic: float = 0.55
    speeds: tuple[float, float] = (0.1, 1.0)

    def force(self, place: Complex, velocity: Complex) -> Complex:
        """Force on the foot."""
        depth, rate = np.maximum(-place.imag, 0.0), -velocity.imag
        spring = self.stiffness * depth**self.exponent
        normal = np.maximum(spring + self.damping * smooth(depth / self.ramp) * rate, 0.0) * (depth > 0.0)
        speed, (slow, fast) = np.abs(velocity.real), self.speeds
        fall = smooth((speed - slow) / (fast - slow))
        share = self.static * smooth(speed / slow) + (self.dynamic - self.static) * fall
        return np.asarray(-np.sign(velocity.real) * share * normal + 1j * normal)


@dataclass(frozen=True)
class Hydraulics:
    """Valve and cylinder of each actuator, and the force loop on it; section 7.2 of the nominal data."""

    supply: float = 16e6
    tank: float = 1e5
    bulk: float = 1.2e9
    vapour: float = 2000.0
    bore: float = 0.016
    rod: float = 0.010
    stroke: float = 0.080
    retracted: float = 0.281
    lines: tuple[float, float] = (2.9e-6, 1.7e-6)
    leakage: float = 1.7e-13
    flow_gain: float = 7.5 / 60e3 / (0.010 * np.sqrt(70e5 / 2.0))
    frequency: float = 2.0 * np.pi * 250.0
    damping: float = 0.7
    current: float = 0.010
    transition: float = 1e4
    viscous: float = 700.0
    stop: tuple[float, float] = (5e8, 2e4)
    force_gain: float = 3e-7
    velocity_gain: float = 0.008

    @property
    def areas(self) -> tuple[float, float]:
        """Areas of both sides of the piston."""
        return np.pi / 4.0 * self.bore**2, np.pi / 4.0 * (self.bore**2 - self.rod**2)

    def at_rest(self) -> tuple[float, float]:
        """Pressures without net force: ``A pa = alpha A pb``, ``pa + pb = ps + pt``."""
        full, ring = self.areas
        total = self.supply + self.tank
        return total * ring / (full + ring), total * full / (full + ring)

    def root(self, drop: Array) -> Array:
        """Signed root of a pressure drop, a cubic through zero below the transition."""
        share = drop / self.transition
        near = np.sqrt(self.transition) * share * (3.0 - np.abs(share)) / 2.0
        return np.asarray(np.where(np.abs(share) < 1.0, near, np.sign(drop) * np.sqrt(np.abs(drop))))

    def flows(self, spool: Array, a: Array, b: Array) -> tuple[Array, Array]:
        """Into chamber a, out of chamber b."""
        opening = self.flow_gain * np.clip(spool, -self.current, self.current)
        forward = spool > 0.0
        into = np.where(forward, self.root(self.supply - a), self.root(a - self.tank))
        out = np.where(forward, self.root(b - self.tank), self.root(self.supply - b))
        return opening * into, opening * out

    def force(self, length: Array, rate: Array, states: Array) -> Array:
        """Force that pushes the ends apart: oil, seal and stops; states are spool, spool rate, chambers a and b."""
        full, ring = self.areas
        a, b = np.maximum(states[2], self.vapour), np.maximum(states[3], self.vapour)
        way = length - self.retracted
        stiffness, damping = self.stop
        low = np.where(way < 0.0, np.maximum(-stiffness * way - damping * rate, 0.0), 0.0)
        out = way - self.stroke
        high = np.where(out > 0.0, np.maximum(stiffness * out + damping * rate, 0.0), 0.0)
        return np.asarray(full * a - ring * b - self.viscous * rate + low - high)

    def rates(self, length: Array, rate: Array, states: Array, current: float) -> list[Array]:
        """Rates of spool, spool rate and chambers, inside the stroke."""
        full, ring = self.areas
        spool, spool_rate, a, b = states[0], states[1], *(np.maximum(p, self.vapour) for p in states[2:4])
        target = np.clip(current, -self.current, self.current)
        acceleration = self.frequency**2 * (target - spool) - 2.0 * self.damping * self.frequency * spool_rate
        into, out = self.flows(spool, a, b)
        way, leak = length - self.retracted, self.leakage * (a - b)
        return [
            spool_rate,
            acceleration,
            self.bulk / (self.lines[0] + full * way) * (into - full * rate - leak),
            self.bulk / (self.lines[1] + ring * (self.stroke - way)) * (-out + ring * rate + leak),
        ]


def smooth(t: Array) -> Array:
    """Cubic step from 0 to 1."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
