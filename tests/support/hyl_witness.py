"""The HyL leg solved without vpm: plane vectors as complex numbers, Kane's equations, solved by SciPy.

A leg on a vertical slider with a foot that may leave the ground: seven bodies (slider, upper and lower leg, barrel and
rod of two cylinders), hip and knee as revolute joints or on bushings, driven by joint controllers, by springs with
dampers along the cylinders, or by hydraulic cylinders under force control. Equations of motion: partial velocities J of
every centre of mass and every angle (T. Kane, D. Levinson, "Dynamics", 1985, section 6.1),
``sum J^T m (J z'' + b - g) = Q`` with b what accelerates at z'' = 0. Nothing is shared with the package.

Masses: M. D'Imperio 2016, table 5.1, CAD column; geometry: IIT 2017, HyQ standard definition, V4.0.
``python tests/support/hyl_witness.py`` writes `values/hyl_witness.json`.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from hyl_laws import Array, Ground, Hydraulics
from hyl_plane import Frame, Point, Rod

GRAVITY = 9.81
UPPER, LOWER = 0.350, 0.341
HIP_BASE, KNEE_BASE, TIP = 0.3219, 0.3218, 0.045
HIP_ANGLE, KNEE_ANGLE, KNEE_TIP_ANGLE = np.radians([6.24, 8.04, 6.0])
SLIDER, THIGH, SHANK = (7.360, 0.0), (0.885, 2.750e-3), (0.876, 0.325e-3)
#: Mass of barrel and rod, and one inertia for both, of the hip's and the knee's cylinder.
CYLINDERS = ((1.216, 0.215, 0.338e-3), (1.214, 0.215, 0.769e-3))
THIGH_CENTER, SHANK_CENTER, BARREL_CENTER, ROD_CENTER = 0.14, 0.1254, 0.11, 0.09
DESIRED = np.radians([40.0, -80.0])
DAMPING = 6.0
MASS = 7.360 + 0.885 + 0.876 + 1.216 + 0.215 + 1.214 + 0.215

#: Radial stiffness and damping of hip and knee (N/m, N s/m).
Bushings = tuple[float, float, float, float]
STIFF: Bushings = (1e8, 188.0, 1e8, 187.0)
#: Stiffness P / l^2 (N/m), free length (m), damping D / l^2 (N s/m) of the cylinders as springs, at the desired pose.
SPRINGS = (
    (92613.45275980336, 0.2992406736841064, 3704.538110392134),
    (74432.4715784517, 0.3217759833552673, 2977.298863138068),
)

Drive = Literal["torques", "pistons", "springs", "hydraulic"]


@dataclass
class Motion:
    """The leg in a state: terms of its equation of motion ``mass z'' + load = Q``."""

    mass: Array
    load: Array
    cylinders: tuple[Rod, Rod]
    foot: Point


@dataclass(frozen=True)
class Leg:
    """The machine."""

    payload: float = 0.0  #: On the slider (kg).
    #: Stiffness and damping of hip and knee in the plane, (N/m, N s/m, N/m, N s/m); None for revolute joints.
    bushings: Bushings | None = None
    #: Of the joint controllers: torques on the joints, forces of the cylinders, or currents of their valves; one of
    #: {"torques", "pistons", "springs", "hydraulic"}.
    drive: Drive = "torques"
    proportional: float = 150.0  #: Of the joint controllers (N m/rad).
    period: float | None = None  #: Sample time of the controllers (s); None is without sampling.
    #: Stiffness, free length and damping of the hip's and the knee's cylinder.
    springs: tuple[tuple[float, float, float], tuple[float, float, float]] = SPRINGS
    method: Literal["Radau", "DOP853"] = "DOP853"  #: Of SciPy: implicit, or explicit of order 8.
    ground: Ground = field(default_factory=Ground)
    oil: Hydraulics = field(default_factory=Hydraulics)

    @property
    def size(self) -> int:
        """Coordinates: height of the slider, angles of hip and knee; on bushings (x, y, angle) of each."""
        return 3 if self.bushings is None else 7

    @property
    def joints(self) -> list[int]:
        """Places of the two angles."""
        return [1, 2] if self.bushings is None else [3, 6]

    def motion(self, z: Array, v: Array) -> Motion:
        """Terms of the equation of motion; z and v of shape (coordinates, states)."""
        n, unit = self.size, np.eye(self.size)[:, :, None]
        hip, knee = self.joints
        nothing = np.zeros(z.shape[1:], complex)
        slider = Point(1j * z[0], 1j * unit[0] + nothing, nothing)
        hip_axis, knee_shift = slider, None
        if self.bushings is not None:
            hip_axis = Point(slider.place + z[1] + 1j * z[2], slider.partial + unit[1] + 1j * unit[2], nothing)
            knee_shift = (z[4] + 1j * z[5], v[4] + 1j * v[5], unit[4] + 1j * unit[5])
        thigh = Frame(hip_axis, z[hip] - np.pi / 2.0, v[hip], unit[hip])
        knee_axis = thigh.point(UPPER)
        if knee_shift is not None:
            shift, rate, by = knee_shift
            turn, moved = np.exp(1j * thigh.angle), thigh.point(UPPER + shift)
            knee_axis = Point(moved.place, moved.partial + turn * by, moved.bias + 2j * thigh.spin * turn * rate)
        shank = Frame(knee_axis, thigh.angle + z[knee], thigh.spin + v[knee], thigh.partial + unit[knee])
        fixed = Frame(slider, np.zeros(z.shape[1:]), np.zeros(z.shape[1:]), np.zeros((n, 1)))
        rods = (
            Rod(fixed.point(HIP_BASE * np.exp(1j * HIP_ANGLE)), thigh.point(TIP), v),
            Rod(
                thigh.point(UPPER - KNEE_BASE * np.exp(1j * KNEE_ANGLE)),
                shank.point(TIP * np.exp(-1j * KNEE_TIP_ANGLE)),
                v,
            ),
        )
        mass, load = np.zeros((n, n, *z.shape[1:])), np.zeros(z.shape)

        def add(body: tuple[float, float], center: Point, turn: Array, turn_bias: Array | float = 0.0) -> None:
            nonlocal mass, load
            weight, inertia = body
            mass = mass + weight * (np.conj(center.partial)[:, None] * center.partial[None]).real
            mass = mass + inertia * turn[:, None] * turn[None]
            load = load + weight * (np.conj(center.partial) * (center.bias + 1j * GRAVITY)).real
            load = load + inertia * turn * turn_bias

        add((SLIDER[0] + self.payload, SLIDER[1]), slider, fixed.partial)
        add(THIGH, thigh.point(THIGH_CENTER), thigh.partial)
        add(SHANK, shank.point(SHANK_CENTER), shank.partial)
        for rod, (barrel, piston, inertia) in zip(rods, CYLINDERS, strict=True):
            both = barrel + piston
            add((barrel, inertia * barrel / both), rod.point(rod.start, BARREL_CENTER), rod.turn, rod.turn_bias)
            add((piston, inertia * piston / both), rod.point(rod.end, -ROD_CENTER), rod.turn, rod.turn_bias)
        return Motion(mass, load, rods, shank.point(LOWER))

    def commands(self, state: Array) -> Array:
        """What the controllers command in a state: torques, forces, or currents of the valves."""
        motion, z, v, inner = self._split(state)
        joints = self.joints
        torques = self.proportional * (DESIRED[:, None] - z[joints]) - DAMPING * v[joints]
        if self.drive == "torques":
            return torques
        if self.drive == "pistons":
            return np.array([torques[k] / rod.lever[joints[k]] for k, rod in enumerate(motion.cylinders)])
        commands = []
        for k, rod in enumerate(motion.cylinders):
            states = inner[4 * k : 4 * k + 4]
            wanted = torques[k] / rod.lever[joints[k]]
            force = self.oil.force(rod.length, rod.rate, states)
            commands.append(self.oil.force_gain * (wanted - force) + self.oil.velocity_gain * rod.rate)
        return np.array(commands)

    def _split(self, state: Array) -> tuple[Motion, Array, Array, Array]:
        n = self.size
        z, v = state[:n], state[n : 2 * n]
        return self.motion(z, v), z, v, state[2 * n : -1]

    def rate(self, state: Array, held: Array | None = None) -> Array:
        """Rates of states of shape (size, n): coordinates, rates, cylinders, impulse of the ground."""
        motion, z, v, inner = self._split(state)
        effort, inner_rates = self._drive(motion, inner, state, held)
        ground = self.ground.force(motion.foot.place, motion.foot.velocity(v))
        effort = effort + (np.conj(motion.foot.partial) * ground).real - motion.load
        if self.bushings is not None:
            stiff_hip, lossy_hip, stiff_knee, lossy_knee = self.bushings
            effort[1:3] -= stiff_hip * z[1:3] + lossy_hip * v[1:3]
            effort[4:6] -= stiff_knee * z[4:6] + lossy_knee * v[4:6]
        mass, right = np.moveaxis(motion.mass, -1, 0), np.moveaxis(effort, -1, 0)[..., None]
        acceleration = np.moveaxis(np.linalg.solve(mass, right)[..., 0], 0, -1)
        return np.concatenate([v, acceleration, inner_rates, ground.imag[None]])

    def _drive(self, motion: Motion, inner: Array, state: Array, held: Array | None) -> tuple[Array, Array]:
        effort = np.zeros(motion.load.shape)
        if self.drive == "springs":
            for rod, (k, free, c) in zip(motion.cylinders, self.springs, strict=True):
                effort += rod.lever * (k * (free - rod.length) - c * rod.rate)
            return effort, inner
        commands = self.commands(state) if held is None else held[:, None]
        if self.drive == "torques":
            effort[self.joints] = commands
            return effort, inner
        if self.drive == "pistons":
            for rod, force in zip(motion.cylinders, commands, strict=True):
                effort += rod.lever * force
            return effort, inner
        rates: list[Array] = []
        for k, rod in enumerate(motion.cylinders):
            states = inner[4 * k : 4 * k + 4]
            effort += rod.lever * self.oil.force(rod.length, rod.rate, states)
            rates += self.oil.rates(rod.length, rod.rate, states, commands[k])
        return effort, np.array(rates)

    def start(self, drop: float = 0.05) -> Array:
        """State at rest with the desired angles, the foot above the ground."""
        z = np.zeros(self.size)
        z[0] = UPPER * np.cos(DESIRED[0]) + LOWER * np.cos(DESIRED.sum()) + drop
        z[self.joints] = DESIRED
        inner = [0.0, 0.0, *self.oil.at_rest()] * 2 if self.drive == "hydraulic" else []
        return np.array([*z, *np.zeros(self.size), *inner, 0.0])

    def scales(self) -> Array:
        """Size of each state, for absolute tolerances."""
        inner = [1e-3, 1.0, 1e6, 1e6] * 2 if self.drive == "hydraulic" else []
        fine = np.full(self.size, 1e-2)
        if self.bushings is not None:
            fine[[1, 2, 4, 5]] = 1e-5
        return np.array([*fine, *np.full(self.size, 0.1), *inner, 1.0])

    def simulate(self, times: Array, tolerance: float = 1e-9, state: Array | None = None) -> Array:
        """States at increasing times, of shape (times, states); the first is that of `state` or of `start`."""
        now = self.start() if state is None else state
        period = self.period or (times[-1] - times[0])
        found, begin = [now], times[0]
        for k in range(round((times[-1] - times[0]) / period)):
            end = times[0] + (k + 1) * period
            held = None if self.period is None else self.commands(now[:, None])[:, 0]
            wanted = times[(times > begin + 1e-12) & (times <= end + 1e-12)]
            ends = np.union1d(wanted, end) if wanted.size == 0 or abs(wanted[-1] - end) > 1e-12 else wanted
            options: dict[str, Any] = {"jac": self._slopes_of(held)} if self.method == "Radau" else {}
            solved = solve_ivp(
                self._rate_of(held),
                (begin, ends[-1]),
                now,
                method=self.method,
                t_eval=ends,
                rtol=tolerance,
                atol=tolerance * self.scales(),
                **options,
            )
            if not solved.success:
                raise RuntimeError(solved.message)
            now, begin = solved.y[:, -1], ends[-1]
            found += list(solved.y.T[: wanted.size])
        return np.array(found)

    def _rate_of(self, held: Array | None) -> Callable[[float, Array], Array]:
        def rate(_: float, state: Array) -> Array:
            flat = state.ndim == 1
            rates = self.rate(state[:, None] if flat else state, held)
            return rates[:, 0] if flat else rates

        return rate

    def _slopes_of(self, held: Array | None) -> Callable[[float, Array], Array]:
        steps = 1e-6 * self.scales()

        def slopes(_: float, state: Array) -> Array:
            moved = np.diag(steps)
            ahead, behind = (self.rate(state[:, None] + way * moved, held) for way in (1.0, -1.0))
            return np.asarray((ahead - behind) / (2.0 * steps))

        return slopes

    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of the leg that hangs in the air, its controllers without samples (1/s)."""
        n = 2 * self.size
        return np.asarray(np.linalg.eigvals(self._slopes_of(None)(0.0, self.start())[:n, :n]))

    def observe(self, states: Array, times: Array) -> dict[str, Array]:
        """Channels of a simulation: height, angles, cylinders, ground, torques."""
        motion, z, v, inner = self._split(states.T)
        ground = self.ground.force(motion.foot.place, motion.foot.velocity(v))
        hip, knee = motion.cylinders
        seen = {
            "time": times,
            "height": z[0],
            "hip": z[self.joints[0]],
            "knee": z[self.joints[1]],
            "hip_length": hip.length,
            "knee_length": knee.length,
            "normal_force": ground.imag,
            "tangential_force": ground.real,
            "impulse": states[:, -1],
            "momentum": (motion.mass[0] * v).sum(axis=0),
        }
        if self.drive == "hydraulic":
            for k, (name, rod) in enumerate((("hip", hip), ("knee", knee))):
                states_k = inner[4 * k : 4 * k + 4]
                seen[f"{name}_force"] = self.oil.force(rod.length, rod.rate, states_k)
                seen[f"{name}_spool"] = states_k[0]
                seen[f"{name}_pressure_a"] = np.maximum(states_k[2], self.oil.vapour)
                seen[f"{name}_pressure_b"] = np.maximum(states_k[3], self.oil.vapour)
        elif self.drive == "springs":
            for name, rod, (k_s, free, c) in zip(("hip", "knee"), (hip, knee), self.springs, strict=True):
                seen[f"{name}_force"] = k_s * (free - rod.length) - c * rod.rate
        else:
            forces = replace(self, drive="pistons").commands(states.T)
            seen |= {"hip_force": forces[0], "knee_force": forces[1]}
        return seen

    def rest(self) -> tuple[Array, Array]:
        """Angles where the joint controllers carry the weight on a smooth floor, and the cylinders' forces there."""

        def gap(q: Array) -> Array:
            z = np.array([UPPER * np.cos(q[0]) + LOWER * np.cos(q.sum()), *q])[:, None]
            motion = Leg(payload=self.payload).motion(z, np.zeros((3, 1)))
            climb = -motion.foot.partial.imag[1:, 0]  # of the hip axis while the foot stays at height zero
            weight = motion.load[1:, 0] + climb * motion.load[0, 0]
            return np.asarray(self.proportional * (DESIRED - q) - weight)

        q = np.asarray(fsolve(gap, DESIRED - 0.1, xtol=1e-12))
        z = np.array([0.5, *q])[:, None]
        rods = Leg().motion(z, np.zeros((3, 1))).cylinders
        levers = np.array([rods[0].lever[1, 0], rods[1].lever[2, 0]])
        return q, self.proportional * (DESIRED - q) / levers


VALUES = Path(__file__).parents[1] / "values" / "hyl_witness.json"
#: Machines that stand in the file of values.
CASES: dict[str, Leg] = {
    "rigid, low gain": Leg(drive="pistons", period=1e-3),
    "rigid, high gain": Leg(drive="pistons", period=1e-3, proportional=300.0),
    "bushings, low gain": Leg(drive="pistons", period=1e-3, bushings=STIFF),
    "springs": Leg(drive="springs"),
    "springs, bushings": Leg(drive="springs", bushings=STIFF),
    "hydraulic, low gain": Leg(drive="hydraulic", period=1e-3),
    "hydraulic, high gain": Leg(drive="hydraulic", period=1e-3, proportional=300.0),
    "hydraulic, bushings": Leg(drive="hydraulic", period=1e-3, bushings=STIFF),
}
#: Multiples of 1 ms: the impact finely, the rest coarsely.
TIMES = np.concatenate([np.arange(0, 100, 50), np.arange(100, 130, 2), np.arange(130, 405, 15)]) / 1000.0


def main() -> None:
    """Write the file of values: the drop from 50 mm of every case, to a relative tolerance of 1e-10."""
    content = {}
    for name, leg in CASES.items():
        seen = leg.observe(leg.simulate(TIMES, 1e-10), TIMES)
        content[name] = {key: [float(f"{number:.12g}") for number in column] for key, column in seen.items()}
        print(name, content[name]["height"][-1])
    VALUES.write_text(json.dumps(content, indent=None).replace("}, ", "},\n") + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
