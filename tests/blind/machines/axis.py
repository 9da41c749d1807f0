"""One driven axis: a carriage on rails, or an unbalanced rotor turning in a vertical plane, behind a cascade."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from blind.driveline import Driven
from blind.effects import Scale
from blind.loads import Array, Column, stack
from blind.loop import Cascade
from blind.machine import Draft, Layout, Signal, Writer
from blind.motion import moves, sines
from blind.noise import encoder

GRAVITY = 9.81

_SITES = {
    "joint": ("axis",),
    "link": ("body",),
    "actuator": ("drive",),
    "sensor": ("encoder",),
    "world": ("world",),
}


class _Mass:
    """Inertia of the axis with its payload, and its weight if it is out of balance."""

    def __init__(self, columns: Sequence[Column], *, rotary: bool) -> None:
        mass, lever = stack(columns, ["body"], "payload.mass"), stack(columns, ["body"], "payload.lever")
        body = stack(columns, ["body"], "mass")
        if rotary:
            centre = stack(columns, ["body"], "centre")
            self.total = stack(columns, ["body"], "inertia") + body * centre**2 + mass * lever**2
            self.unbalance = GRAVITY * (body * centre + mass * lever)
        else:
            self.total, self.unbalance = body + mass, np.zeros_like(body)
        self.tilt = stack(columns, ["world"], "gravity_tilt.angle")
        self.swings = bool(self.unbalance.any())

    def inertia(self, q: Array) -> tuple[Array, ...]:
        del q
        return (self.total,)

    def load(self, q: Array, v: Array) -> Array:
        return self.unbalance * np.sin(q + self.tilt) if self.swings else np.zeros_like(v)


@dataclass(frozen=True)
class Axis:
    """The axis, linear or rotary."""

    rotary: bool
    step: float = 1.6e-4

    @property
    def name(self) -> str:
        """Name in the proving ground."""
        return "axis_rotary" if self.rotary else "axis_linear"

    @property
    def layout(self) -> Layout:
        """Signals; what makes no sense on the machine: a rotor inertia and a tilt of a slide are a mass and a load."""
        unit, command = ("rad", "A") if self.rotary else ("m", "V")
        without = ("link_flexibility", "structural_damping") + (
            () if self.rotary else ("sensor_offset", "gravity_tilt")
        )
        return Layout(
            sensors=(Signal("encoder", "axis.position", unit),),
            commands=(Signal("drive", "drive.command", command),),
            references=(Signal("drive", "drive.reference", unit),),
            sites=_SITES,
            without=("rotor_inertia", *without),
        )

    def draft(self, generator: Generator, needs: Sequence[str]) -> Draft:
        g, rotary = generator, self.rotary
        mass = float(g.uniform(3.0, 40.0)) if not rotary else float(g.uniform(1.0, 4.0))
        centre = float(g.uniform(0.03, 0.12)) if rotary else 0.0
        own = mass * float(g.uniform(0.06, 0.15)) ** 2
        way, speed = (float(g.uniform(0.5, 1.5)), float(g.uniform(0.8, 2.0))) if rotary else (0.25, 0.35)
        moving = own + mass * centre**2 if rotary else mass
        share = float(g.uniform(0.15, 0.5))
        acceleration = speed**2 / (0.4 * way)
        weight = mass * GRAVITY * centre * min(1.0, 0.6 * way)
        effort = float(np.hypot(moving * (1.0 + share) * acceleration, weight))
        gain = effort / float(g.uniform(0.5, 2.0))
        viscous = float(g.uniform(0.05, 0.2)) * effort / speed
        coulomb = float(g.uniform(0.05, 0.2)) * effort
        base = [("viscous_friction", "axis")]
        if g.uniform() < 0.6 or "coulomb_friction@axis" in needs:
            base.append(("coulomb_friction", "axis"))
        inertia = moving * (1.0 + share)
        values = {
            "body.mass": mass,
            "body.centre": centre,
            "body.inertia": own,
            "axis.rotor": share * moving,
            "drive.gain": gain,
            "axis.viscous_friction.viscous": viscous,
            "servo.velocity_gain": float(g.uniform(40.0, 70.0)) * inertia / gain,
            "servo.position_gain": float(g.uniform(6.0, 12.0)),
            "servo.limit": 8.0 * effort / gain,
            "drive.noise": float(g.uniform(0.003, 0.015)) * effort / gain,
            "motion.way": way,
            "motion.speed": speed,
            **encoder(g, "encoder", (2e-5, 5e-5, 1e-4) if rotary else (5e-7, 1e-6, 5e-6)),
        }
        if len(base) > 1:
            values["axis.coulomb_friction.coulomb"] = coulomb
        calibratable = {"body.inertia" if rotary else "body.mass": 0.1, "axis.viscous_friction.viscous": 0.2}
        if rotary:
            calibratable["body.centre"] = 0.1
        if len(base) > 1:
            calibratable["axis.coulomb_friction.coulomb"] = 0.2
        scale = Scale(
            effort=effort,
            speed=speed,
            way=way,
            inertia=moving,
            command=effort / gain,
            mass=mass,
            lever=2.0 * centre,
            coulomb=coulomb,
            viscous=viscous,
        )
        scales = dict.fromkeys((s for sites in _SITES.values() for s in sites), scale)
        return Draft(values, calibratable, tuple(base), scales, float(g.choice((250.0, 500.0, 1000.0, 2000.0))))

    def text(self, values: Mapping[str, float], draft: Draft, base: Sequence[tuple[str, str]]) -> str:
        show = Writer(values, draft.calibratable)
        effort, coordinate, command = ("N m", "rad", "A") if self.rotary else ("N", "m", "V")
        if self.rotary:
            body = f"""mass = {show("body.mass", "kg")}
center_of_mass = [0.0, 0.0, {_negative(show("body.centre", "m"))}]
inertia = [{values["body.inertia"]!r}, {show("body.inertia", "kg m^2")}, {values["body.inertia"]!r}, 0.0, 0.0, 0.0]"""
        else:
            body = f"mass = {show('body.mass', 'kg')}"
        kind, axis = ("revolute", "[0.0, 1.0, 0.0]") if self.rotary else ("prismatic", "[1.0, 0.0, 0.0]")
        return f"""name = "{self.name}"
gravity = [0.0, 0.0, -9.81]

[bodies.body]
{body}

[joints.axis]
type = "{kind}"
parent = "world"
child = "body"
axis = {axis}
rotor_inertia = {show("axis.rotor", "kg m^2" if self.rotary else "kg")}

{show.motor("drive", "axis", effort, command)}

[sensors.encoder]
measures = "axis.position"

{show.cascade("servo", "drive", "axis", command, coordinate)}

{show.effects(base, {"axis": (effort, coordinate)})}"""

    def plant(self, columns: Sequence[Column], step: float) -> Driven:
        mass, gain = _Mass(columns, rotary=self.rotary), stack(columns, ["drive"], "gain")
        return Driven(["axis"], columns, mass, step, gain)

    def controller(self, columns: Sequence[Column], dt: float) -> Cascade:
        return Cascade.of(columns, ["servo"], dt)

    def mixed(self, values: Mapping[str, float]) -> Mapping[str, Mapping[str, float]]:
        del values
        return {}

    def reference(self, generator: Generator, draft: Draft, time: Array, kind: str) -> Array:
        shape = moves if kind == "validate" else sines
        return shape(generator, time, draft.values["motion.way"], draft.values["motion.speed"])[None, :]


def _negative(parameter: str) -> str:
    """The same parameter with the other sign."""
    return parameter.replace("value = ", "value = -")


LINEAR = Axis(rotary=False)
ROTARY = Axis(rotary=True)
