"""What acts on a joint beside its drive, for many joints and many cases side by side, from the elementary laws.

Dry friction is set-valued: it holds a joint still as long as it can and never turns its motion round, by the impulses
of a time-stepping scheme (J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", 1988).
Hysteresis is a parallel connection of springs that slip one after the other (W. D. Iwan, J. Appl. Mech. 33, 1966). An
end stop is a contact after Hunt and Crossley (J. Appl. Mech. 42, 1975).

Arrays have the shape (joints, columns); a column is one record of one case.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Column = Mapping[str, float]

#: Springs that slip one after the other: share of the way and of the force at which each one slips.
SLIP_WAYS = np.array([0.15, 0.4, 1.0])
SLIP_FORCES = np.array([0.3, 0.4, 0.3])


def clip(x: Array, low: Array | float, high: Array | float) -> Array:
    """Values within bounds; three times as quick as the function of this name of NumPy on short arrays."""
    return np.asarray(np.minimum(np.maximum(x, low), high))


def stack(columns: Sequence[Column], sites: Sequence[str], name: str, default: float = 0.0) -> Array:
    """Values ``site.name`` of every column, shape (sites, columns)."""
    return np.array([[column.get(f"{site}.{name}", default) for column in columns] for site in sites])


class JointLoads:
    """Loads of all joints in all columns; laws that no column has cost nothing."""

    def __init__(self, joints: Sequence[str], columns: Sequence[Column], step: float) -> None:
        self._smooth: list[Callable[[Array, Array, float, Array], Array]] = []
        self._dry: list[Callable[[Array, Array, float, Array], Array]] = []
        self._scale: Callable[[float], Array] | None = None
        self._step = step
        self.seal: Array | None = None
        """Dry friction of seals, which depends on pressures; a hydraulic machine sets it at each step."""

        def get(name: str, default: float = 0.0) -> Array:
            return stack(columns, joints, name, default)

        self._friction(get)
        self._conservative(get)
        self._outside(get)
        force, way = get("hysteresis.force"), get("hysteresis.way", 1.0)
        if force.any():
            self._slip_limit = SLIP_FORCES[:, None, None] * force
            self._slip_rate = self._slip_limit / (SLIP_WAYS[:, None, None] * way)
            self._slip = np.zeros_like(self._slip_limit)
            self._smooth.append(self._hysteresis)

    def smooth(self, q: Array, v: Array, time: float, effort: Array) -> Array:
        """Loads that follow from the motion, counted against it; the hysteresis goes on by one step."""
        total = np.zeros_like(q)
        for law in self._smooth:
            total += law(q, v, time, effort)
        return total

    def dry(self, q: Array, v: Array, time: float, effort: Array) -> Array | None:
        """Largest dry friction, or None if there is nowhere any."""
        if not self._dry and self.seal is None:
            return None
        total = np.zeros_like(q) if self.seal is None else self.seal
        for law in self._dry:
            total = total + law(q, v, time, effort)
        if self._scale is not None:
            total = total * self._scale(time)
        return np.maximum(total, 0.0)

    def _friction(self, get: Callable[..., Array]) -> None:
        viscous, coulomb = get("viscous_friction.viscous"), get("coulomb_friction.coulomb")
        stribeck, speed = get("stribeck_friction.stribeck"), get("stribeck_friction.stribeck_velocity", 1.0)
        dry_part, viscous_part = (
            get("asymmetric_friction.coulomb_difference"),
            get("asymmetric_friction.viscous_difference"),
        )
        if viscous.any():
            self._smooth.append(lambda _q, v, _t, _u: viscous * v)
        if coulomb.any():
            self._dry.append(lambda _q, _v, _t, _u: coulomb)
        if stribeck.any():
            self._dry.append(lambda _q, v, _t, _u: stribeck * np.exp(-((v / speed) ** 2)))
        if dry_part.any():
            self._dry.append(lambda _q, v, _t, _u: 0.5 * dry_part * np.sign(v))
        if viscous_part.any():
            self._smooth.append(lambda _q, v, _t, _u: 0.5 * viscous_part * np.abs(v))

    def _conservative(self, get: Callable[..., Array]) -> None:
        bias, stiffness, rest = get("bias_force.force"), get("spring.stiffness"), get("spring.rest")
        cosine, sine = get("torque_ripple.cosine"), get("torque_ripple.sine")
        wave = 2.0 * np.pi / get("torque_ripple.period", 1.0)
        stop, damping = get("end_stop.stiffness"), get("end_stop.damping")
        low, high = get("end_stop.low", -1e9), get("end_stop.high", 1e9)
        if bias.any():
            self._smooth.append(lambda _q, _v, _t, _u: bias)
        if stiffness.any():
            self._smooth.append(lambda q, _v, _t, _u: stiffness * (q - rest))
        if cosine.any() or sine.any():
            self._smooth.append(lambda q, _v, _t, _u: cosine * np.cos(wave * q) + sine * np.sin(wave * q))

        def end_stop(q: Array, v: Array, _time: float, _effort: Array) -> Array:
            above, below = np.maximum(q - high, 0.0), np.maximum(low - q, 0.0)
            push = above * np.maximum(stop + damping * v, 0.0)
            return np.asarray(push - below * np.maximum(stop - damping * v, 0.0))

        if stop.any():
            self._smooth.append(end_stop)

    def _outside(self, get: Callable[..., Array]) -> None:
        """Effects that no diagnosis screens for."""
        drag, cubic = get("quadratic_drag.drag"), get("cubic_spring.stiffness")
        load, place = get("load_dependent_friction.share"), get("position_dependent_friction.coulomb")
        wave, shift = (
            2.0 * np.pi / get("position_dependent_friction.period", 1.0),
            get("position_dependent_friction.phase"),
        )
        cogging, cog = get("load_dependent_cogging.share"), 2.0 * np.pi / get("load_dependent_cogging.period", 1.0)
        beat, rate = get("periodic_disturbance.amplitude"), 2.0 * np.pi * get("periodic_disturbance.frequency")
        drift, warm = get("friction_drift.share"), get("friction_drift.time", 1.0)
        if drag.any():
            self._smooth.append(lambda _q, v, _t, _u: drag * v * np.abs(v))
        if cubic.any():
            self._smooth.append(lambda q, _v, _t, _u: cubic * q**3)
        if cogging.any():
            self._smooth.append(lambda q, _v, _t, u: cogging * np.abs(u) * np.cos(cog * q))
        if beat.any():
            self._smooth.append(lambda _q, _v, t, _u: beat * np.sin(rate * t))
        if load.any():
            self._dry.append(lambda _q, _v, _t, u: load * np.abs(u))
        if place.any():
            self._dry.append(lambda q, _v, _t, _u: 0.5 * place * (1.0 + np.cos(wave * q + shift)))
        if drift.any():
            self._scale = lambda t: 1.0 + drift * (1.0 - np.exp(-t / warm))

    def _hysteresis(self, _q: Array, v: Array, _time: float, _effort: Array) -> Array:
        stretched = self._slip + self._slip_rate * (self._step * v)
        self._slip = clip(stretched, -self._slip_limit, self._slip_limit)
        return np.asarray(self._slip.sum(0))
