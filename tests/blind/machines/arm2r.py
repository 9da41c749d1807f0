"""An arm with two links in a vertical plane, hanging at zero, each joint behind a cascade, by Lagrange's equations.

M. Spong, S. Hutchinson and M. Vidyasagar, *Robot Modeling and Control*, section 6.4; the angles count from hanging.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from blind.driveline import Driven
from blind.effects import Scale
from blind.loads import Array, Column, stack
from blind.loop import Cascade
from blind.machine import Draft, Layout, Signal, Writer, rub
from blind.motion import moves, sines
from blind.noise import encoder

GRAVITY = 9.81
JOINTS, BODIES, DRIVES = ("shoulder", "elbow"), ("upper", "lower"), ("first", "second")
ENCODERS, SERVOS = ("encoder_1", "encoder_2"), ("servo_1", "servo_2")
_SITES = {"joint": JOINTS, "link": BODIES, "actuator": DRIVES, "sensor": ENCODERS, "world": ("world",)}


class TwoLinks:
    """Two links in a vertical plane with payloads, perhaps on a tilted base."""

    def __init__(self, columns: Sequence[Column]) -> None:
        mass, centre, inertia = (stack(columns, BODIES, name) for name in ("mass", "centre", "inertia"))
        extra, lever = stack(columns, BODIES, "payload.mass"), stack(columns, BODIES, "payload.lever")
        first = mass * centre + extra * lever
        own = inertia + mass * centre**2 + extra * lever**2
        length = stack(columns, ["upper"], "length")[0]
        beyond = mass[1] + extra[1]
        self.alone, self.outer = own[0] + beyond * length**2, own[1]
        self.coupling = first[1] * length
        self.weight_1, self.weight_2 = GRAVITY * (first[0] + beyond * length), GRAVITY * first[1]
        self.tilt = stack(columns, ["world"], "gravity_tilt.angle")[0]

    def inertia(self, q: Array) -> tuple[Array, ...]:
        turned = self.coupling * np.cos(q[1])
        return self.alone + self.outer + 2.0 * turned, self.outer + turned, self.outer

    def load(self, q: Array, v: Array) -> Array:
        turning = self.coupling * np.sin(q[1])
        far = self.weight_2 * np.sin(q[0] + q[1] + self.tilt)
        near = self.weight_1 * np.sin(q[0] + self.tilt)
        return np.array([near + far - turning * (2.0 * v[0] + v[1]) * v[1], far + turning * v[0] ** 2])


@dataclass(frozen=True)
class Arm2R:
    """The arm."""

    name: str = "arm2r"
    step: float = 1.6e-4

    @property
    def layout(self) -> Layout:
        """Signals and sites."""
        return Layout(
            sensors=tuple(Signal(e, f"{j}.position", "rad") for e, j in zip(ENCODERS, JOINTS, strict=True)),
            commands=tuple(Signal(d, f"{d}.command", "A") for d in DRIVES),
            references=tuple(Signal(d, f"{d}.reference", "rad") for d in DRIVES),
            sites=_SITES,
            without=("link_flexibility", "structural_damping"),
        )

    def draft(self, generator: Generator, needs: Sequence[str]) -> Draft:
        g = generator
        length = float(g.uniform(0.3, 0.5))
        masses = float(g.uniform(3.0, 6.0)), float(g.uniform(1.0, 2.5))
        centres = 0.5 * length * float(g.uniform(0.8, 1.2)), 0.2 * float(g.uniform(0.7, 1.2))
        inertias = masses[0] * length**2 / 12.0, masses[1] * 0.3**2 / 12.0
        felt = masses[0] * centres[0] ** 2 + inertias[0] + masses[1] * (length + centres[1]) ** 2
        felt, outer = felt + inertias[1], masses[1] * centres[1] ** 2 + inertias[1]
        weights = (masses[0] * centres[0] + masses[1] * (length + centres[1]), masses[1] * centres[1])
        dry = g.uniform() < 0.6 or any(need.startswith("coulomb") for need in needs)
        way, speed = 1.1, float(g.uniform(0.9, 1.8))
        values: dict[str, float] = {"upper.length": length, "motion.way": way, "motion.speed": speed}
        calibratable: dict[str, float] = {}
        scales: dict[str, Scale] = {}
        base: list[tuple[str, str]] = []
        for k, (own, weight) in enumerate(zip((felt, outer), weights, strict=True)):
            joint, body, drive = JOINTS[k], BODIES[k], DRIVES[k]
            rotor = own * float(g.uniform(0.3, 1.0))
            effort = float(np.hypot(0.5 * GRAVITY * weight, (own + rotor) * 2.0 * speed**2))
            gain = effort / float(g.uniform(0.5, 2.0))
            viscous, coulomb = (
                float(g.uniform(0.04, 0.15)) * effort / speed,
                float(g.uniform(0.03, 0.12)) * effort,
            )
            values |= {
                f"{body}.mass": masses[k],
                f"{body}.centre": centres[k],
                f"{body}.inertia": inertias[k],
                f"{joint}.rotor": rotor,
                f"{joint}.viscous_friction.viscous": viscous,
                f"{drive}.gain": gain,
                f"{drive}.noise": float(g.uniform(0.003, 0.015)) * effort / gain,
                f"{SERVOS[k]}.velocity_gain": float(g.uniform(35.0, 50.0)) * (own + rotor) / gain,
                f"{SERVOS[k]}.position_gain": float(g.uniform(6.0, 10.0)),
                f"{SERVOS[k]}.limit": 8.0 * effort / gain,
                **encoder(g, ENCODERS[k], (2e-5, 5e-5, 1e-4)),
            }
            calibratable |= {f"{body}.centre": 0.1, f"{body}.inertia": 0.2, f"{joint}.viscous_friction.viscous": 0.2}
            rub(joint, coulomb if dry else None, values, calibratable, base)
            lever = length if k == 0 else 0.3
            scale = Scale(effort, speed, way, own, effort / gain, masses[k], lever, coulomb, viscous)
            scales |= dict.fromkeys((joint, body, drive, ENCODERS[k], "world"), scale)
        return Draft(values, calibratable, tuple(base), scales, float(g.choice((250.0, 500.0, 1000.0))))

    def text(self, values: Mapping[str, float], draft: Draft, base: Sequence[tuple[str, str]]) -> str:
        show = Writer(values, draft.calibratable)
        parts = [f'name = "{self.name}"\ngravity = [0.0, 0.0, -9.81]']
        for k, (joint, body, drive, sensor, servo) in enumerate(
            zip(JOINTS, BODIES, DRIVES, ENCODERS, SERVOS, strict=True)
        ):
            known = values[f"{body}.inertia"]
            place = f"translation = [0.0, 0.0, {-values['upper.length']!r}]\n" if k else ""
            parts.append(f"""[bodies.{body}]
mass = {show(f"{body}.mass", "kg")}
center_of_mass = [0.0, 0.0, {show(f"{body}.centre", "m").replace("value = ", "value = -")}]
inertia = [{known!r}, {show(f"{body}.inertia", "kg m^2")}, {known!r}, 0.0, 0.0, 0.0]

[joints.{joint}]
type = "revolute"
parent = "{BODIES[0] if k else "world"}"
child = "{body}"
axis = [0.0, 1.0, 0.0]
{place}rotor_inertia = {show(f"{joint}.rotor", "kg m^2")}

{show.motor(drive, joint, "N m", "A")}

[sensors.{sensor}]
measures = "{joint}.position"

{show.cascade(servo, drive, joint, "A", "rad")}""")
        return "\n\n".join([*parts, show.effects(base, dict.fromkeys(JOINTS, ("N m", "rad")))])

    def plant(self, columns: Sequence[Column], step: float) -> Driven:
        return Driven(JOINTS, columns, TwoLinks(columns), step, stack(columns, DRIVES, "gain"))

    def controller(self, columns: Sequence[Column], dt: float) -> Cascade:
        return Cascade.of(columns, SERVOS, dt)

    def mixed(self, values: Mapping[str, float]) -> Mapping[str, Mapping[str, float]]:
        del values
        return {}

    def reference(self, generator: Generator, draft: Draft, time: Array, kind: str) -> Array:
        shape, values = (moves if kind == "validate" else sines), draft.values
        return np.array([shape(generator, time, values["motion.way"], values["motion.speed"]) for _ in JOINTS])
