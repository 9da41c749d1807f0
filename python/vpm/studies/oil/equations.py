"""What the oil of a cylinder obeys, integrated once.

The pressure equations 4.11 and 4.12 of D'Imperio (2016), each divided by its volume and integrated over time::

    pa/beta - Kv int(u ra/va) + Ci int((pa - pb)/va) = c - ln va
    pb/beta + Kv int(u rb/vb) - Ci int((pa - pb)/vb) = c - ln vb

with ``ra = root(ps - pa)``, ``rb = root(pb - pt)`` for u > 0 and ``root(pa - pt)``, ``root(ps - pb)`` for u < 0; the
volumes are exact functions of the place, so ``A v/va`` is the rate of ``ln va``. ``A`` times the first less ``alpha
A`` times the second is the equation of the force, 5.34 to 5.39 integrated.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vpm.errors import IdentificationError, near_match
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Storable

#: Ways to have both pressures from one force.
RULES = ("steady", "symmetric")

#: Of free air and its change of state, for the column "air" (Pa, 1).
AIR_PRESSURE, AIR_EXPONENT = 101325.0, 1.4


@dataclass(frozen=True, repr=False, eq=False)
class CylinderGeometry(Storable):
    """Areas and volumes of a double-acting cylinder with one rod.

    Attributes
    ----------
    area : float
        Of the piston, on side a, m^2.
    area_ratio : float
        Area on the rod's side b by that of side a; 1 for a rod on both sides.
    stroke : float
        m.
    line_a, line_b : float
        Dead volume between valve and piston at its ends, m^3.
    """

    area: float
    area_ratio: float
    stroke: float
    line_a: float
    line_b: float

    def __post_init__(self) -> None:
        for name in ("area", "area_ratio", "stroke"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise IdentificationError(
                    f"the {name} of the cylinder is {getattr(self, name):g}; it has to be positive"
                )
        for name in ("line_a", "line_b"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise IdentificationError(
                    f"the dead volume {name} is {getattr(self, name):g} m^3; it cannot be negative"
                )
        if self.area_ratio > 1.0:
            raise IdentificationError(
                f"the area_ratio is {self.area_ratio:g}, but the rod makes side b the smaller one; give (1 - "
                "(rod/bore)^2)"
            )
        if self.area > 1.0 or self.stroke > 20.0:
            raise IdentificationError(
                f"an area of {self.area:g} m^2 and a stroke of {self.stroke:g} m are no cylinder's; give m^2 and "
                "m, not mm^2 and mm"
            )

    @classmethod
    def of(cls, model: Model, actuator: str) -> CylinderGeometry:
        """Areas, stroke and line volumes for the oil equations, from a model's hydraulic actuator.

        Parameters
        ----------
        actuator : str
            Its name.

        Raises
        ------
        IdentificationError
            The model has no hydraulic actuator of this name.
        """
        names = {key: f"{actuator}.cylinder.{key}" for key in ("bore", "rod", "stroke", "line_a", "line_b")}
        for name in names.values():
            if name not in model.parameters:
                near = near_match(name, [each for each in model.parameters if ".cylinder." in each])
                raise IdentificationError(f'the model has no parameter "{name}" of a hydraulic cylinder; {near}')
        value = {key: float(model.parameters[name].value) for key, name in names.items()}
        area = 0.25 * np.pi * value["bore"] ** 2
        ratio = 1.0 - (value["rod"] / value["bore"]) ** 2
        return cls(area, ratio, value["stroke"], value["line_a"], value["line_b"])

    def volumes(self, position: Array) -> tuple[Array, Array]:
        """Oil volumes a and b (m^3) at piston places from mid-stroke (m), positive where side a is large."""
        half = 0.5 * self.stroke
        side_b = self.area_ratio * self.area * (half - position)
        return self.line_a + self.area * (half + position), self.line_b + side_b


def pressures_from_force(
    force: Array, opening: Array, supply: Array, tank: Array, geometry: CylinderGeometry, rule: str = "steady"
) -> tuple[Array, Array]:
    """Both oil pressures of a cylinder from its force and a rule that the valve is thought to keep.

    - ``force``, ``opening``: shape (N,), N; opening of the valve in any unit, of which the sign counts
    - ``supply``, ``tank``: shape (N,), Pa
    - ``rule``: ``"steady"``: the flow into one side drives the flow out of the other, in the ratio of the areas, so
      that ``pa + pb/alpha^2 = ps + pt/alpha^2`` outwards and ``pa alpha^2 + pb = ps + pt alpha^2`` inwards.
      ``"symmetric"``: ``pa + pb = ps + pt``, D'Imperio (2016), 5.41, which is so only for equal areas.

    - result ``pressure_a``, ``pressure_b``: shape (N,), Pa
    """
    if rule not in RULES:
        raise IdentificationError(f'the pressure rule "{rule}" is unknown; {near_match(rule, RULES)}')
    alpha, load = geometry.area_ratio, force / geometry.area
    if rule == "symmetric":
        side_b = (supply + tank - load) / (1.0 + alpha)
    else:
        outward = alpha**2 * (supply - load) + tank
        inward = supply + alpha**2 * (tank - load)
        side_b = np.where(opening > 0.0, outward, inward) / (1.0 + alpha**3)
    return load + alpha * side_b, side_b


@dataclass(frozen=True)
class Equation:
    """One balance of oil: stored volume, flow, leakage and air.

    ``stored/beta - Kv int(flow u) + Ci int(leakage) = c - place``.
    """

    name: str
    stored: Array  #: Shape (N,); pressure (Pa) or force (N).
    #: Shape (N,); by unit opening, and by unit leakage.
    flow: Array
    leakage: Array
    air: Array  #: Shape (N,); by unit of entrained air; zeros for the force, whose two sides hold air of two pressures.
    place: Array  #: Shape (N,); logarithms of volumes.
    #: Shape (N,); rate of `place` by the piston's place, 1/m: what noise of the place does to the balance.
    scale: Array


def balances(
    geometry: CylinderGeometry,
    position: Array,
    opening: Array,
    pressures: tuple[Array, Array],
    ports: tuple[Array, Array],
    force: Array | None,
) -> tuple[Equation, ...]:
    """Oil balances of both chambers, or that of the force.

    - ``position``, ``opening``: shape (N,), m from mid-stroke; unit of the command
    - ``pressures``, ``ports``: each of shape (N,), of sides a and b, and of supply and tank, Pa
    - ``force``: shape (N,), N; with it the one balance of the force, without it those of both chambers
    """
    (pa, pb), (ps, pt), alpha = pressures, ports, geometry.area_ratio
    va, vb = geometry.volumes(position)
    area_a, area_b = geometry.area, alpha * geometry.area
    root_a = np.where(opening > 0.0, signed_root(ps - pa), signed_root(pa - pt))
    root_b = np.where(opening > 0.0, signed_root(pb - pt), signed_root(ps - pb))
    across = pa - pb
    side_a = Equation("side a", pa, root_a / va, across / va, _air(pa), np.log(va), area_a / va)
    side_b = Equation("side b", pb, -root_b / vb, -across / vb, _air(pb), np.log(vb), -area_b / vb)
    if force is None:
        return side_a, side_b

    def both(left: Array, right: Array) -> Array:
        return area_a * left - area_b * right

    flow, leakage = both(side_a.flow, side_b.flow), both(side_a.leakage, side_b.leakage)
    place, scale = both(side_a.place, side_b.place), both(side_a.scale, side_b.scale)
    return (Equation("force", force, flow, leakage, np.zeros_like(force), place, scale),)


def signed_root(drop: Array) -> Array:
    """Signed root in the oil equations, ``sign(d) sqrt(|d|)``: flow may go back."""
    return np.asarray(np.sign(drop) * np.sqrt(np.abs(drop)), dtype=np.float64)


def _air(pressure: Array) -> Array:
    """Stored volume of a unit of air in the oil, ``-(p0/p)^(1/kappa)``.

    The compliance of 4.15 corrected, to first order in the fraction of air, integrated over the pressure.
    """
    return np.asarray(-((AIR_PRESSURE / np.maximum(pressure, 1.0)) ** (1.0 / AIR_EXPONENT)), dtype=np.float64)


def through_spool(command: Array, dt: float, spool: tuple[float, float], *, held: bool = False) -> Array:
    """Spool place behind its command by second-order equations, exactly.

    - ``command``: shape (N,)
    - ``dt``: s
    - ``spool``: natural frequency (rad/s) and damping ratio
    - ``held``: whether each sample is held until the next, as a digital controller does; else they are joined by
      straight lines
    """
    from scipy.signal import cont2discrete, lfilter, lfilter_zi

    omega, damping = spool
    if not (omega > 0.0 and damping > 0.0):
        raise IdentificationError(
            f"a spool of {omega:g} rad/s and a damping ratio of {damping:g} does not follow; both have to be positive"
        )
    numerator, denominator = np.array([omega**2]), np.array([1.0, 2.0 * damping * omega, omega**2])
    discrete = cont2discrete((numerator, denominator), dt, method="zoh" if held else "foh")
    b, a = np.ravel(discrete[0]), np.ravel(discrete[1])
    return np.asarray(lfilter(b, a, command, zi=lfilter_zi(b, a) * command[0])[0], dtype=np.float64)
