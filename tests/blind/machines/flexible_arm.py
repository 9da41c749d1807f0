"""An arm with two flexible links in a level plane, motors with gears in both hubs, strain gauges near both roots."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from blind.chain import JOINTS, LINKS, SEGMENTS, Chain
from blind.effects import Scale
from blind.loads import Array, Column, stack
from blind.loop import Cascade
from blind.machine import Draft, Layout, Signal, Writer, rub
from blind.motion import jumps, moves, sines
from blind.noise import converter, encoder

DRIVES, ENCODERS, BRIDGES, SERVOS = (tuple(f"{n}_{k}" for k in (1, 2)) for n in ("motor", "encoder", "bridge", "servo"))
DENSITY = 2700.0
#: How much stiffer than it is a link is where the oracle takes its flexibility away; stiffer takes finer steps.
NEARLY_RIGID = 2.2
#: Jumps of the references, which make the links ring [rad].
JUMP = 0.03
_SITES = {
    "joint": JOINTS,
    "link": LINKS,
    "actuator": DRIVES,
    "sensor": (*ENCODERS, *BRIDGES),
    "world": ("world",),
}


class _Plant(Chain):
    """The chain with the gains of its drives."""

    gain: Array

    def outputs(self) -> Array:
        return np.concatenate([self.joint_angles(), self.strains()])

    def advance(self, command: Array, time: float) -> None:
        super().advance(self.gain * command, time)


@dataclass(frozen=True)
class FlexibleArm:
    """The arm."""

    name: str = "flexible_arm"
    step: float = 7e-5

    @property
    def layout(self) -> Layout:
        """Signals and sites."""
        gauges = (Signal(b, f"{link}_root.strain", "1") for b, link in zip(BRIDGES, LINKS, strict=True))
        return Layout(
            sensors=(*(Signal(e, f"{j}.position", "rad") for e, j in zip(ENCODERS, JOINTS, strict=True)), *gauges),
            commands=tuple(Signal(d, f"{d}.command", "A") for d in DRIVES),
            references=tuple(Signal(d, f"{d}.reference", "rad") for d in DRIVES),
            sites=_SITES,
            without=("backlash", "joint_compliance", "rotor_inertia"),
            absent={"link_flexibility": {"share": NEARLY_RIGID}},
        )

    def draft(self, generator: Generator, needs: Sequence[str]) -> Draft:
        g = generator
        dry = g.uniform() < 0.6 or any(need.startswith("coulomb") for need in needs)
        lengths, thick = (0.5, 0.45), (float(g.uniform(5e-3, 6.5e-3)), float(g.uniform(3.5e-3, 4.5e-3)))
        tips = float(g.uniform(0.4, 0.9)), float(g.uniform(0.05, 0.2))
        young, width = float(g.uniform(66e9, 74e9)), 0.03
        densities = tuple(DENSITY * width * t for t in thick)
        outer = densities[1] * lengths[1] ** 3 / 3.0 + tips[1] * lengths[1] ** 2
        reach = sum(lengths)
        far = tips[1] * reach**2 + densities[1] * (reach**3 - lengths[0] ** 3) / 3.0
        felt = (densities[0] * lengths[0] ** 3 / 3.0 + tips[0] * lengths[0] ** 2 + far, outer)
        way, speed = 0.9, float(g.uniform(0.8, 1.4))
        values: dict[str, float] = {
            "motion.way": way,
            "motion.speed": speed,
            "elbow.housing_inertia": 2e-2,
            "upper.width": width,
        }
        calibratable: dict[str, float] = {}
        scales: dict[str, Scale] = {}
        base: list[tuple[str, str]] = []
        for k, (joint, link, drive) in enumerate(zip(JOINTS, LINKS, DRIVES, strict=True)):
            hub = felt[k] * float(g.uniform(0.5, 1.0))
            effort = (felt[k] + hub) * 2.5 * speed**2
            gain = effort / float(g.uniform(0.5, 2.0))
            viscous, coulomb = (
                float(g.uniform(0.05, 0.15)) * effort / speed,
                float(g.uniform(0.03, 0.12)) * effort,
            )
            values |= {
                f"{link}.length": lengths[k],
                f"{link}.thickness": thick[k],
                f"{link}.young": young,
                f"{link}.bending": young * width * thick[k] ** 3 / 12.0,
                f"{link}.line_density": densities[k],
                f"{link}.tip_mass": tips[k],
                f"{link}.structural_damping.time": float(g.uniform(1e-4, 3e-4)),
                f"{joint}.hub_inertia": hub,
                f"{joint}.viscous_friction.viscous": viscous,
                f"{drive}.gain": gain,
                f"{drive}.noise": float(g.uniform(0.002, 0.01)) * effort / gain,
                f"{SERVOS[k]}.velocity_gain": float(g.uniform(12.0, 20.0)) * (felt[k] + hub) / gain,
                f"{SERVOS[k]}.position_gain": float(g.uniform(3.0, 5.0)),
                f"{SERVOS[k]}.limit": 8.0 * effort / gain,
                **encoder(g, ENCODERS[k], (2e-5, 5e-5, 1e-4)),
                **converter(BRIDGES[k], 4e-3, 16, float(g.uniform(2e-7, 1e-6))),
            }
            calibratable |= {f"{link}.bending": 0.1, f"{joint}.viscous_friction.viscous": 0.2}
            calibratable |= {f"{link}.tip_mass": 0.1}
            rub(joint, coulomb if dry else None, values, calibratable, base)
            scale = Scale(effort, speed, way, felt[k], effort / gain, tips[k], lengths[k], coulomb, viscous)
            scales |= dict.fromkeys((joint, link, drive, ENCODERS[k], "world"), scale)
            scales |= {BRIDGES[k]: Scale(way=4e-4)}
        return Draft(values, calibratable, tuple(base), scales, float(g.choice((500.0, 1000.0))))

    def text(self, values: Mapping[str, float], draft: Draft, base: Sequence[tuple[str, str]]) -> str:
        show = Writer(values, draft.calibratable)
        parts = [f'name = "{self.name}"\ngravity = [0.0, 0.0, -9.81]']
        hubs = ("hub", "flange")
        for k, (joint, link, drive, hub) in enumerate(zip(JOINTS, LINKS, DRIVES, hubs, strict=True)):
            own = values[f"{joint}.hub_inertia"]
            width, thick = values["upper.width"], values[f"{link}.thickness"]
            young = values[f"{link}.bending"] * 12.0 / (width * thick**3)
            place = 'parent = "upper"\naxis = [-1.0, 0.0, 0.0]' if k else 'parent = "world"\naxis = [0.0, 0.0, 1.0]'
            turned = "" if k else "rotation = [0.0, 1.5707963267948966, 0.0]\n"
            damping = values.get(f"{link}.structural_damping.time")
            flexible = f"{link}.link_flexibility.share" not in values
            spread = draft.calibratable[f"{link}.bending"] * young
            elastic = f"{{ value = {young!r}, uncertainty = {spread!r} }}" if flexible else repr(young)
            lost = "" if damping is None else f"damping = {{ stiffness = {damping!r} }}\n"
            housing = values["elbow.housing_inertia"] if k == 0 else 1e-9
            parts.append(f"""[bodies.{hub}]
mass = 1e-6
inertia = [{own!r}, {own!r}, {own!r}, 0.0, 0.0, 0.0]

[joints.{joint}]
type = "revolute"
{place}
child = "{hub}"

[beams.{link}]
parent = "{hub}"
{turned}length = {values[f"{link}.length"]!r}
level = "{"strain(4)" if flexible else "rigid"}"
deforms = ["bending_x"]
material = {{ young = {elastic}, poisson = 0.33, density = {DENSITY!r} }}
section = {{ shape = "rectangle", width = {width!r}, height = {thick!r} }}
{lost}
[bodies.{link}_tip]
mass = {show(f"{link}.tip_mass", "kg")}
inertia = [{housing!r}, {housing!r}, {housing!r}, 0.0, 0.0, 0.0]

[joints.{link}_mount]
type = "fixed"
parent = "{link}"
child = "{link}_tip"

[gauges.{link}_root]
beam = "{link}"
at = {values[f"{link}.length"] / SEGMENTS!r}
y = {-0.5 * thick!r}

{show.motor(drive, joint, "N m", "A")}

[sensors.{ENCODERS[k]}]
measures = "{joint}.position"

[sensors.{BRIDGES[k]}]
measures = "{link}_root.strain"

{show.cascade(SERVOS[k], drive, joint, "A", "rad")}""")
        return "\n\n".join([*parts, show.effects(base, dict.fromkeys(JOINTS, ("N m", "rad")))])

    def plant(self, columns: Sequence[Column], step: float) -> _Plant:
        plant = _Plant(columns, step)
        plant.gain = stack(columns, DRIVES, "gain")
        return plant

    def controller(self, columns: Sequence[Column], dt: float) -> Cascade:
        return Cascade.of(columns, SERVOS, dt)

    def mixed(self, values: Mapping[str, float]) -> Mapping[str, Mapping[str, float]]:
        del values
        return {}

    def reference(self, generator: Generator, draft: Draft, time: Array, kind: str) -> Array:
        shape, values = (moves if kind == "validate" else sines), draft.values
        paths = [shape(generator, time, values["motion.way"], values["motion.speed"]) for _ in JOINTS]
        return np.array([path + jumps(generator, time, JUMP) for path in paths])
