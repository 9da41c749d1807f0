"""A machine in time, many of the same structure side by side: Moreau's midpoint rule.

Each step goes half a step with the old speed, finds the new speed from all forces in the middle, and goes the other
half with the new one. Dry friction gives impulses within its limits; those that stop a joint are found together by
projected Gauss-Seidel sweeps (J. Moreau, "Numerical aspects of the sweeping process", 1999), so that joints truly
stick. Without dry friction the rule is of second order.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from second_suite.laws import Array, MaxwellSlip, coupling, dry, smooth
from second_suite.machine import Machine, Values

#: Sweeps over all joints that may stick, where more than one can.
SWEEPS = 6
#: Effects that put the motor before a soft or loose gear, those of drives, and those that sit at the motor otherwise.
SPLITTING = frozenset({"joint_compliance", "backlash"})
AT_MOTOR = frozenset({"torque_ripple"})
AT_LOAD = frozenset({"spring", "cubic_spring", "bias_force", "end_stop", "quadratic_drag", "hysteresis"})


@dataclass(frozen=True)
class Hidden:
    """An effect at a site with its numbers; ``base`` says which number of the machine it is, if it is one."""

    effect: str
    site: str
    values: Mapping[str, float]
    base: str = ""


class Plant:
    """The machine with what is hidden in it: coordinates of the tree, then those of motors behind soft gears."""

    def __init__(self, machine: Machine, values: Values, hidden: Sequence[Hidden], step: float) -> None:
        self.machine, self.values, self.step = machine, values, step
        self.hidden = [h for h in hidden if not h.base]
        self.links = len(machine.joints)
        self.gears = [(machine.index(h.site), h) for h in self.hidden if h.effect in SPLITTING]
        self.motor = list(range(self.links))
        for k, (joint, _) in enumerate(self.gears):
            self.motor[joint] = self.links + k
        self.size = self.links + len(self.gears)
        self.columns = len(next(iter(values.values())))
        self.q = np.zeros((self.size, self.columns))
        self.v = np.zeros_like(self.q)
        self.rate_before = np.zeros_like(self.q)
        self.impulse = np.zeros_like(self.q)
        self.time = 0.0
        self.loads = [(self._coordinate(h), h) for h in self.hidden if self._at_joint(h)]
        self.slips = {id(h): MaxwellSlip(h.values, self.columns) for _, h in self.loads if h.effect == "hysteresis"}
        self.base = [
            (self._side(i), values.get(f"{j.name}.coulomb"), values.get(f"{j.name}.viscous"))
            for i, j in enumerate(machine.joints)
        ]
        self.rotors = [
            (self.motor[i], values[f"{j.name}.rotor"])
            for i, j in enumerate(machine.joints)
            if f"{j.name}.rotor" in values
        ]
        self.tilt = next((h.values["angle"] for h in self.hidden if h.effect == "gravity_tilt"), None)
        if self.tilt is not None:
            self.values = {**values, "tilt": np.full(self.columns, self.tilt)}
        for h in self.hidden:
            if h.effect == "payload":
                self.values = {**self.values, "payload": np.full(self.columns, h.values["mass"])}

    def _at_joint(self, h: Hidden) -> bool:
        return any(h.site == joint.name for joint in self.machine.joints) and h.effect not in SPLITTING

    def _side(self, joint: int) -> int:
        return joint if self.machine.friction_at_load else self.motor[joint]

    def _coordinate(self, h: Hidden) -> int:
        joint = self.machine.index(h.site)
        if h.effect in AT_MOTOR:
            return self.motor[joint]
        return joint if h.effect in AT_LOAD else self._side(joint)

    def start(self, place: Array) -> None:
        """Stand still at a place of the links, (n, columns); motors where their gears are relaxed."""
        self.q[: self.links] = place
        for joint, _ in self.gears:
            self.q[self.motor[joint]] = place[joint]

    def measured(self) -> tuple[Array, Array]:
        """What encoders are fixed to: the motors' places, and their speeds, (n, columns)."""
        return self.q[self.motor], self.v[self.motor]

    def pressures(self) -> Array:
        """What pressure gauges are screwed into, (chambers, columns)."""
        return np.zeros((0, self.columns))

    def mass_and_load(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Mass matrix (columns, size, size) with rotors, and loads (size, columns)."""
        n = self.links
        mass, load = self.machine.tree(self.values, q[:n], v[:n])
        if self.size > n:
            wide, long = np.zeros((self.columns, self.size, self.size)), np.zeros_like(q)
            wide[:, :n, :n], long[:n] = mass, load
            mass, load = wide, long
        else:
            mass = mass.copy()
        for i, rotor in self.rotors:
            mass[:, i, i] += rotor
        return mass, load

    def forces(self, q: Array, v: Array, effort: Array, load: Array) -> Array:
        """All forces but dry friction."""
        total = -load
        total[self.motor] += effort
        for i, _, viscous in self.base:
            if viscous is not None:
                total[i] -= viscous * v[i]
        for i, h in self.loads:
            force = smooth(h.effect, h.values, q[i], v[i])
            if force is not None:
                total[i] += force
            elif h.effect == "hysteresis":
                total[i] += self.slips[id(h)].moved(self.step * v[i])
        for joint, h in self.gears:
            motor = self.motor[joint]
            passed = coupling(h.effect, h.values, q[motor] - q[joint], v[motor] - v[joint])
            total[motor] -= passed
            total[joint] += passed
        return total

    def limits(self, q: Array, v: Array, effort: Array) -> dict[int, tuple[Array, Array]]:
        """Limits of dry friction by coordinate."""
        found: dict[int, tuple[Array, Array]] = {}

        def add(i: int, up: Array, down: Array) -> None:
            before = found.get(i)
            found[i] = (up, down) if before is None else (before[0] + up, before[1] + down)

        for i, coulomb, _ in self.base:
            if coulomb is not None:
                add(i, coulomb, coulomb)
        for i, h in self.loads:
            drive = effort[self.machine.index(h.site)]
            pair = dry(h.effect, h.values, q[i], v[i], self.time, drive)
            if pair is not None:
                add(i, *pair)
        return found

    def advance(self, effort: Array) -> None:
        """One step under efforts of the drives (n, columns), zero where there is none."""
        dt = self.step
        middle, speed = self.q + 0.5 * dt * self.v, self.v + 0.5 * self.rate_before
        mass, load = self.mass_and_load(middle, speed)
        inverse = np.reciprocal(mass) if self.size == 1 else np.asarray(np.linalg.inv(mass), np.float64)
        push = self.forces(middle, speed, effort, load)
        if self.size == 1:
            new = self.v + dt * inverse[:, 0].T * push
        else:
            new = self.v + dt * np.einsum("cij,jc->ic", inverse, push)
        new = self._stick(new, inverse, self.limits(middle, self.v, effort))
        self.rate_before = new - self.v
        self.q, self.v = middle + 0.5 * dt * new, new
        self.time += dt

    def _stick(self, v: Array, inverse: Array, limits: Mapping[int, tuple[Array, Array]]) -> Array:
        dt, held = self.step, self.impulse
        if len(limits) > 1:
            for i in limits:
                v = v + inverse[:, :, i].T * held[i]
        else:
            held[:] = 0.0
        for _ in range(SWEEPS if len(limits) > 1 else 1):
            for i, (up, down) in limits.items():
                weight = inverse[:, i, i]
                new = np.clip(held[i] - v[i] / weight, -up * dt, down * dt)
                v = v + inverse[:, :, i].T * (new - held[i])
                held[i] = new
        return v
