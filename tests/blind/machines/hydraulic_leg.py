"""A leg with two joints in gravity, its hip fixed, each joint turned by a cylinder that closes a triangle.

Geometry of HyL (examples/hyl/hydraulic.toml); the length of a cylinder and its lever arm by the law of cosines.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from blind.driveline import Driveline
from blind.effects import Scale
from blind.hydraulics import Cylinders
from blind.loads import Array, Column, stack
from blind.loop import Proportional
from blind.machine import Draft, Layout, Signal, Writer, rub
from blind.machines.arm2r import GRAVITY, TwoLinks
from blind.motion import moves, sines
from blind.noise import converter, encoder

BAR = 1e5
JOINTS, BODIES, DRIVES = ("hip", "knee"), ("upper", "lower"), ("hip_drive", "knee_drive")
LENGTH, START, RETRACTED, STROKE = 0.35, (0.1, -1.3), 0.281, 0.08
#: Pins in the frames of their bodies: hip on world (x forward, y up) and upper leg, knee on upper and lower leg [m].
HIP_PINS = ((0.3199928467749999, 0.03498839826044419), (0.045, 0.0))
KNEE_PINS = ((0.03136307959319706, -0.04500836537432492), (0.0447534852915723, -0.004703780847044406))
GAUGES = tuple(f"{joint}_gauge_{side}" for joint in JOINTS for side in "ab")
_SITES = {
    "joint": JOINTS,
    "link": BODIES,
    "world": ("world",),
    "actuator": DRIVES,
    "valve": DRIVES,
    "cylinder": DRIVES,
    "supply": ("pump",),
    "sensor": ("hip_encoder", "knee_encoder", *GAUGES),
}


class Triangles:
    """Lengths of both cylinders and their derivatives by the joint angles."""

    def __init__(self) -> None:
        far = np.array([complex(*HIP_PINS[0]), complex(*KNEE_PINS[0]) - LENGTH])
        near = np.array([complex(*HIP_PINS[1]) * -1j, complex(*KNEE_PINS[1])])
        self.sum = (np.abs(far) ** 2 + np.abs(near) ** 2)[:, None]
        self.product = (np.abs(far) * np.abs(near))[:, None]
        self.angle = (np.angle(near) - np.angle(far))[:, None]

    def __call__(self, q: Array) -> tuple[Array, Array]:
        """Lengths and lever arms ds/dq, shape (2, columns)."""
        length = np.sqrt(self.sum - 2.0 * self.product * np.cos(q + self.angle))
        return length, self.product * np.sin(q + self.angle) / length


class _Plant:
    """The leg with its cylinders."""

    def __init__(self, columns: Sequence[Column], step: float) -> None:
        links = TwoLinks(columns)
        self.joints = Driveline(JOINTS, columns, links, step)
        self.oil = Cylinders(DRIVES, columns, "pump", step)
        self.triangles = Triangles()
        self.seal = stack(columns, DRIVES, "seal_friction.area")
        q = np.array(START)[:, None] + self.joints.q
        self.joints.q = self.joints.motor_q = q
        self.oil.start(links.load(q, np.zeros_like(q)) / self.triangles(q)[1])

    def outputs(self) -> Array:
        pa, pb = self.oil.pa, self.oil.pb
        return np.concatenate([self.joints.encoder, pa[:1], pb[:1], pa[1:], pb[1:]])

    def advance(self, command: Array, time: float) -> None:
        v, half = self.joints.v, 0.5 * self.joints.step
        length, lever = self.triangles(self.joints.q + half * v)
        middle = length - (RETRACTED + 0.5 * STROKE)
        force = self.oil.middle_force(command, middle, lever * (v + half * self.joints.a))
        if self.seal.any():
            self.joints.loads.seal = self.seal * self.oil.pressure_sum * np.abs(lever)
        self.joints.advance(lever * force, time)
        self.oil.finish(middle, lever * 0.5 * (v + self.joints.v))


@dataclass(frozen=True)
class HydraulicLeg:
    """The leg."""

    name: str = "hydraulic_leg"
    step: float = 1e-4

    @property
    def layout(self) -> Layout:
        """Signals and sites."""
        pressures = [f"{d}.pressure_{side}" for d in DRIVES for side in "ab"]
        return Layout(
            sensors=(
                *(Signal(f"{j}_encoder", f"{j}.position", "rad") for j in JOINTS),
                *(Signal(g, p, "Pa") for g, p in zip(GAUGES, pressures, strict=True)),
            ),
            commands=tuple(Signal(d, f"{d}.command", "A") for d in DRIVES),
            references=tuple(Signal(d, f"{d}.reference", "rad") for d in DRIVES),
            sites=_SITES,
            without=(
                *("rotor_inertia", "joint_compliance", "backlash", "torque_ripple", "load_dependent_cogging"),
                *("cubic_spring", "link_flexibility", "structural_damping"),
            ),
        )

    def draft(self, generator: Generator, needs: Sequence[str]) -> Draft:
        g = generator
        masses = 0.885 * float(g.uniform(0.8, 1.2)), 0.876 * float(g.uniform(0.8, 1.2))
        centres = 0.14 * float(g.uniform(0.9, 1.1)), 0.1254 * float(g.uniform(0.9, 1.1))
        inertias = masses[0] * 0.35**2 / 12.0, masses[1] * 0.33**2 / 12.0
        outer = masses[1] * centres[1] ** 2 + inertias[1]
        own = masses[0] * centres[0] ** 2 + inertias[0] + masses[1] * (LENGTH + centres[1]) ** 2 + inertias[1], outer
        weights = masses[0] * centres[0] + masses[1] * (LENGTH + centres[1]), masses[1] * centres[1]
        dry = g.uniform() < 0.6 or any(need.startswith("coulomb") for need in needs)
        way, speed, share = 0.45, float(g.uniform(0.6, 1.0)), 0.045
        values: dict[str, float] = {
            "upper.length": LENGTH,
            "motion.way": way,
            "motion.speed": speed,
            "pump.pressure": 160.0 * BAR,
            "pump.tank": BAR,
            "pump.modulus": float(g.uniform(1.0e9, 1.5e9)),
        }
        calibratable = {"pump.modulus": 0.2}
        scales: dict[str, Scale] = {"pump": Scale()}
        base: list[tuple[str, str]] = []
        for k, (joint, body, drive) in enumerate(zip(JOINTS, BODIES, DRIVES, strict=True)):
            viscous = float(g.uniform(12.0, 20.0)) * (own[k] if k == 0 else 0.2 * own[0])
            effort = float(np.hypot(0.5 * GRAVITY * weights[k], viscous * speed))
            coulomb = float(g.uniform(0.03, 0.12)) * effort
            command = share * speed / 107.0
            values |= {
                f"{body}.mass": masses[k],
                f"{body}.centre": centres[k],
                f"{body}.inertia": inertias[k],
                f"{joint}.viscous_friction.viscous": viscous,
                f"{drive}.area": np.pi / 4.0 * 0.016**2,
                f"{drive}.ratio": 1.0 - (10.0 / 16.0) ** 2,
                f"{drive}.stroke": STROKE,
                f"{drive}.line_a": 2.9e-6,
                f"{drive}.line_b": 1.7e-6,
                f"{drive}.flow_gain": 6.681531e-6 * float(g.uniform(0.9, 1.1)),
                f"{drive}.limit": 0.01,
                f"{drive}.frequency": 250.0,
                f"{drive}.damping": 0.7,
                f"{drive}.noise": float(g.uniform(0.002, 0.01)) * command,
                f"{joint}_loop.proportional": (-1.0, 1.0)[k] * float(g.uniform(3.0, 5.0)) * share / 107.0,
                f"{joint}_loop.limit": 0.01,
                **encoder(g, f"{joint}_encoder", (2e-5, 8e-5)),
                **converter(f"{joint}_gauge_a", 250.0 * BAR, 16, float(g.uniform(0.02, 0.1)) * BAR),
                **converter(f"{joint}_gauge_b", 250.0 * BAR, 16, float(g.uniform(0.02, 0.1)) * BAR),
            }
            calibratable |= {
                f"{body}.centre": 0.1,
                f"{drive}.flow_gain": 0.1,
                f"{joint}.viscous_friction.viscous": 0.2,
            }
            rub(joint, coulomb if dry else None, values, calibratable, base)
            scale = Scale(effort, speed, way, own[k], command, masses[k], LENGTH, coulomb, viscous, START[k])
            scales |= dict.fromkeys((joint, body, drive, f"{joint}_encoder", "world"), scale)
            scales |= dict.fromkeys((f"{joint}_gauge_a", f"{joint}_gauge_b"), Scale(way=20.0 * BAR))
        return Draft(values, calibratable, tuple(base), scales, float(g.choice((500.0, 1000.0))))

    def text(self, values: Mapping[str, float], draft: Draft, base: Sequence[tuple[str, str]]) -> str:
        show = Writer(values, draft.calibratable)
        parts = [
            f"""name = "{self.name}"
gravity = [0.0, -9.81, 0.0]

{show.pump()}"""
        ]
        ends = (("world", "upper", HIP_PINS), ("upper", "lower", KNEE_PINS))
        for k, (joint, body, drive) in enumerate(zip(JOINTS, BODIES, DRIVES, strict=True)):
            parent, child, pins = ends[k]
            place = f"translation = [{LENGTH!r}, 0.0, 0.0]" if k else "rotation = [0.0, 0.0, -1.5707963267948966]"
            inertia = values[f"{body}.inertia"]
            parts.append(f"""[bodies.{body}]
mass = {show(f"{body}.mass", "kg")}
center_of_mass = [{show(f"{body}.centre", "m")}, 0.0, 0.0]
inertia = [0.0, {inertia!r}, {inertia!r}, 0.0, 0.0, 0.0]

[joints.{joint}]
type = "revolute"
parent = "{parent}"
child = "{body}"
axis = [0.0, 0.0, 1.0]
{place}

[lines.{joint}_cylinder]
from = {{ parent = "{parent}", point = [{pins[0][0]!r}, {pins[0][1]!r}, 0.0] }}
to = {{ parent = "{child}", point = [{pins[1][0]!r}, {pins[1][1]!r}, 0.0] }}

[actuators.{drive}]
type = "hydraulic"
line = "{joint}_cylinder"
supply = "pump"
retracted_length = {RETRACTED!r}
command_unit = "A"

{show.cylinder(drive, STROKE)}

[sensors.{joint}_encoder]
measures = "{joint}.position"

[sensors.{joint}_gauge_a]
measures = "{drive}.pressure_a"

[sensors.{joint}_gauge_b]
measures = "{drive}.pressure_b"

[controllers.{joint}_loop]
type = "pid"
actuator = "{drive}"
measures = "{joint}.position"
proportional = {show(f"{joint}_loop.proportional", "A/rad")}
limit = {show(f"{joint}_loop.limit", "A")}""")
        return "\n\n".join([*parts, show.effects(base, dict.fromkeys(JOINTS, ("N m", "rad")))])

    def plant(self, columns: Sequence[Column], step: float) -> _Plant:
        return _Plant(columns, step)

    def controller(self, columns: Sequence[Column], dt: float) -> Proportional:
        del dt
        loops = [f"{joint}_loop" for joint in JOINTS]
        return Proportional(stack(columns, loops, "proportional"), stack(columns, loops, "limit"))

    def mixed(self, values: Mapping[str, float]) -> Mapping[str, Mapping[str, float]]:
        return {
            f"{d}.force": {
                f"{d}.pressure_a": values[f"{d}.area"],
                f"{d}.pressure_b": -values[f"{d}.area"] * values[f"{d}.ratio"],
            }
            for d in DRIVES
        }

    def reference(self, generator: Generator, draft: Draft, time: Array, kind: str) -> Array:
        shape, values = (moves if kind == "validate" else sines), draft.values
        return np.array([q + shape(generator, time, values["motion.way"], values["motion.speed"]) for q in START])
