"""A servovalve moves a slide with an asymmetric cylinder: position and both pressures are logged.

Numbers around those of D'Imperio (2016), section 4.2 and appendix A.
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
from blind.machine import Draft, Layout, Signal, Writer
from blind.motion import moves, sines
from blind.noise import converter

STROKE, BAR = 0.08, 1e5
_SITES = {
    "joint": ("axis",),
    "link": ("slide",),
    "actuator": ("servo",),
    "valve": ("servo",),
    "cylinder": ("servo",),
    "supply": ("pump",),
    "sensor": ("encoder", "gauge_a", "gauge_b"),
}


class _Slide:
    """A mass on level rails."""

    def __init__(self, columns: Sequence[Column]) -> None:
        self.mass = stack(columns, ["slide"], "mass") + stack(columns, ["slide"], "payload.mass")

    def inertia(self, q: Array) -> tuple[Array, ...]:
        del q
        return (self.mass,)

    def load(self, q: Array, v: Array) -> Array:
        del q
        return np.zeros_like(v)


class _Plant:
    """Cylinder and slide; the piston is at the place of the encoder."""

    def __init__(self, columns: Sequence[Column], step: float) -> None:
        self.axis = Driveline(["axis"], columns, _Slide(columns), step)
        self.oil = Cylinders(["servo"], columns, "pump", step)
        self.seal = stack(columns, ["servo"], "seal_friction.area")

    def outputs(self) -> Array:
        return np.concatenate([self.axis.encoder, self.oil.pa, self.oil.pb])

    def advance(self, command: Array, time: float) -> None:
        x, v = self.axis.motor_q, self.axis.motor_v
        force = self.oil.middle_force(command, x, v)
        if self.seal.any():
            self.axis.loads.seal = self.seal * self.oil.pressure_sum
        self.axis.advance(force, time)
        self.oil.finish(x + 0.5 * self.axis.step * v, 0.5 * (v + self.axis.motor_v))


@dataclass(frozen=True)
class ServoCylinder:
    """The rig."""

    name: str = "servo_cylinder"
    step: float = 1e-4

    @property
    def layout(self) -> Layout:
        """Signals and sites."""
        return Layout(
            sensors=(
                Signal("encoder", "axis.position", "m"),
                Signal("gauge_a", "servo.pressure_a", "Pa"),
                Signal("gauge_b", "servo.pressure_b", "Pa"),
            ),
            commands=(Signal("servo", "servo.command", "A"),),
            references=(Signal("servo", "servo.reference", "m"),),
            sites=_SITES,
            without=(
                "rotor_inertia",
                "torque_ripple",
                "load_dependent_cogging",
                "link_flexibility",
                "structural_damping",
            ),
        )

    def draft(self, generator: Generator, needs: Sequence[str]) -> Draft:
        g = generator
        mass, way, speed = float(g.uniform(3.0, 25.0)), 0.028, float(g.uniform(0.06, 0.12))
        viscous, coulomb = float(g.uniform(300.0, 900.0)), float(g.uniform(5.0, 30.0))
        effort = 2.0 * viscous * speed
        base = [("viscous_friction", "axis")]
        if g.uniform() < 0.6 or "coulomb_friction@axis" in needs:
            base.append(("coulomb_friction", "axis"))
        command = speed / 107.0
        values = {
            "slide.mass": mass,
            "axis.rotor": 0.5,
            "axis.viscous_friction.viscous": viscous,
            "servo.area": np.pi / 4.0 * 0.016**2,
            "servo.ratio": 1.0 - (10.0 / 16.0) ** 2,
            "servo.stroke": STROKE,
            "servo.line_a": 2.9e-6,
            "servo.line_b": 1.7e-6,
            "servo.flow_gain": 6.681531e-6 * float(g.uniform(0.9, 1.1)),
            "servo.limit": 0.01,
            "servo.frequency": 250.0,
            "servo.damping": 0.7,
            "servo.noise": float(g.uniform(0.002, 0.01)) * command,
            "pump.pressure": 160.0 * BAR,
            "pump.tank": BAR,
            "pump.modulus": float(g.uniform(1.0e9, 1.5e9)),
            "loop.proportional": float(g.uniform(8.0, 14.0)) / 107.0,
            "motion.way": way,
            "motion.speed": speed,
            **converter("encoder", 0.1, int(g.choice((16, 18))), float(g.uniform(5e-7, 2e-6))),
            **converter("gauge_a", 250.0 * BAR, 16, float(g.uniform(0.02, 0.1)) * BAR),
            **converter("gauge_b", 250.0 * BAR, 16, float(g.uniform(0.02, 0.1)) * BAR),
        }
        calibratable = {"pump.modulus": 0.2, "servo.flow_gain": 0.1, "axis.viscous_friction.viscous": 0.2}
        if len(base) > 1:
            values["axis.coulomb_friction.coulomb"] = coulomb
            calibratable["axis.coulomb_friction.coulomb"] = 0.2
        scale = Scale(effort, speed, way, mass, command, mass, 0.0, coulomb, viscous)
        scales = dict.fromkeys((s for sites in _SITES.values() for s in sites), scale)
        pressure = Scale(way=20.0 * BAR)
        scales |= {"gauge_a": pressure, "gauge_b": pressure}
        return Draft(values, calibratable, tuple(base), scales, float(g.choice((500.0, 1000.0, 2000.0))))

    def text(self, values: Mapping[str, float], draft: Draft, base: Sequence[tuple[str, str]]) -> str:
        show = Writer(values, draft.calibratable)
        return f"""name = "{self.name}"
gravity = [0.0, 0.0, -9.81]

[bodies.slide]
mass = {values["slide.mass"] + values["axis.rotor"]!r}

[joints.axis]
type = "prismatic"
parent = "world"
child = "slide"
axis = [1.0, 0.0, 0.0]

{show.pump()}

[actuators.servo]
type = "hydraulic"
joint = "axis"
supply = "pump"
retracted_length = {-0.5 * STROKE!r}

{show.cylinder("servo", STROKE)}

[sensors.encoder]
measures = "axis.position"

[sensors.gauge_a]
measures = "servo.pressure_a"

[sensors.gauge_b]
measures = "servo.pressure_b"

[controllers.loop]
type = "pid"
actuator = "servo"
measures = "axis.position"
proportional = {show("loop.proportional", "A/m")}
limit = {show("servo.limit", "A")}

{show.effects(base, {"axis": ("N", "m")})}"""

    def plant(self, columns: Sequence[Column], step: float) -> _Plant:
        return _Plant(columns, step)

    def controller(self, columns: Sequence[Column], dt: float) -> Proportional:
        del dt
        return Proportional(stack(columns, ["loop"], "proportional"), stack(columns, ["servo"], "limit"))

    def mixed(self, values: Mapping[str, float]) -> Mapping[str, Mapping[str, float]]:
        area = values["servo.area"]
        return {"servo.force": {"servo.pressure_a": area, "servo.pressure_b": -area * values["servo.ratio"]}}

    def reference(self, generator: Generator, draft: Draft, time: Array, kind: str) -> Array:
        shape = moves if kind == "validate" else sines
        return shape(generator, time, draft.values["motion.way"], draft.values["motion.speed"])[None, :]
