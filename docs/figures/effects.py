"""The page docs/catalogue.md and its pictures: what each effect of the catalogue does to a residual, by the package.

python docs/figures/effects.py [FOLDER]

A machine follows a motion of several sines, under the commands that its nominal model needs for that. Drawn is what the
effect adds to the residual, effort applied less effort required, at every sample. A new entry needs a line in `SHOWN`.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from numpy.typing import NDArray

import vpm
from vpm.catalogue import EFFECTS, EffectParameter, EffectType
from vpm.discrepancy.evidence import View
from vpm.identify import InverseDynamicsProblem
from vpm.plot.style import BLUE, SOFT, label, panels, styled

HERE = Path(__file__).resolve().parent

Array = NDArray[np.float64]

#: Values that are drawn, and what the machine has besides; a link of 1.8 kg swings by about 1 rad under 1.6 N m/A.
SHOWN: Mapping[str, dict[str, float]] = {
    "viscous_friction": {"viscous": 0.3},
    "coulomb_friction": {"coulomb": 0.5, "transition_velocity": 0.02},
    "asymmetric_friction": {"coulomb_difference": 0.2, "viscous_difference": 0.2, "transition_velocity": 0.05},
    "stribeck_friction": {"stribeck": 0.4, "stribeck_velocity": 0.6, "transition_velocity": 0.05},
    "bias_force": {"force": 0.4},
    "spring": {"stiffness": 1.5, "rest": 0.3},
    "torque_ripple": {"period": 0.39, "cosine": 0.3, "sine": 0.25},
    "hysteresis": {"force": 0.5, "displacement": 0.2},
    "joint_compliance": {"stiffness": 60.0, "damping": 0.3, "inertia": 0.02},
    "backlash": {"gap": 0.05, "stiffness": 300.0, "damping": 4.0, "inertia": 0.01},
    "rotor_inertia": {"inertia": 0.02},
    "end_stop": {"stiffness": 20.0, "damping": 0.1, "low": -10.0, "high": 0.7},
    "quadratic_drag": {"drag": 0.15},
    "cubic_spring": {"stiffness": 0.8, "rest": 0.2},
    "position_dependent_friction": {"period": 1.1, "cosine": 0.2, "sine": 0.3, "transition_velocity": 0.02},
    "current_ripple": {"period": 0.7, "cosine": 0.25, "sine": 0.1},
    "load_dependent_friction": {"driving": 0.15, "driven": 0.1, "transition_velocity": 0.02},
    "lugre_friction": {
        "coulomb": 0.4,
        "damping": 0.0,
        "displacement": 0.05,
        "excess": 0.5,
        "stribeck_velocity": 0.4,
    },
    "warming_friction": {"coulomb": 0.3, "viscous": 0.1, "time_constant": 4.0, "transition_velocity": 0.02},
    "empirical_force": {
        "reach": 1.2,
        "speed": 4.0,
        "transition_velocity": 0.1,
        "dry": 0.2,
        "dry_position": 0.3,
        "position_3": 0.4,
    },
    "payload": {"mass": 0.4, "x": 0.3, "y": 0.0, "z": 0.1},
    "link_flexibility": {"stiffness": 60.0, "time": 0.005},
    "structural_damping": {"time": 0.001},
    "gravity_tilt": {"first": 0.0, "second": 0.1},
    "input_delay": {"time": 0.005},
    "dead_zone": {"width": 0.25},
    "saturation": {"limit": 1.5},
    "actuator_lag": {"time_constant": 0.02},
    "drive_friction": {"driving": 0.15, "driven": 0.1, "transition_velocity": 0.02},
    "sensor_offset": {"value": 0.06},
    "sensor_gain": {"value": 1.08},
    "sensor_delay": {"time": 0.005},
    "internal_leakage": {"coefficient": 3e-12},
    "valve_dynamics": {"time": 0.002},
    "seal_friction": {"share": 0.03, "transition_velocity": 0.01},
    "entrained_air": {"fraction": 0.02},
    "supply_drop": {"resistance": 3e10, "time_constant": 0.002},
}

SITES = {
    "joint": "shoulder",
    "body": "arm",
    "link": "arm",
    "beam": "strip",
    "actuator": "motor",
    "sensor": "encoder",
    "cylinder": "servo",
    "supply": "pump",
    "world": "world",
}

#: A strip of aluminium at the end of the link: its first bending at about 5 Hz.
STRIP = {
    "parent": "arm",
    "translation": [0.3, 0.0, 0.0],
    "rotation": [0.0, np.pi / 2, 0.0],
    "length": 0.5,
    "level": "modal(1)",
    "deforms": ["bending_y"],
    "material": {"young": 7e10, "poisson": 0.33, "density": 2700.0},
    "section": {"shape": "rectangle", "width": 0.0015, "height": 0.03},
}

#: What sits at these is shown on the rig of a servo-cylinder, by the pressure of its first chamber.
HYDRAULIC = ("cylinder", "supply")
RIG = HERE.parent.parent / "examples" / "servo_cylinder" / "rig.toml"

#: A default beyond it means that nothing comes there.
FAR = 1e6

SINES = ((0.62, 1.3, 0.0), (0.38, 2.9, 1.9), (0.22, 5.3, 0.6), (0.10, 9.1, 2.4), (0.05, 15.7, 4.0))


def nominal(effect: str) -> vpm.Model:
    """One link on a horizontal axis, with what the effect corrects; a beam or a cylinder for what needs it."""
    if EFFECTS[effect].site in HYDRAULIC:
        return vpm.Model.load(RIG)
    content = {
        "name": "arm",
        "gravity": [0.0, 0.0, -9.81],
        "bodies": {"arm": {"mass": 1.8, "center_of_mass": [0.22, 0, 0], "inertia": [0.03, 0.035, 0.05, 0, 0, 0]}},
        "joints": {
            "shoulder": {
                "type": "revolute",
                "parent": "world",
                "child": "arm",
                "axis": [0, 1, 0],
                "rotation": [0, np.pi / 2, 0],
            }
        },
        "actuators": {"motor": {"joint": "shoulder", "gain": 1.6, "command_unit": "A"}},
        "sensors": {"encoder": {"measures": "shoulder.position"}},
    }
    if EFFECTS[effect].site == "beam":
        content["beams"] = {"strip": STRIP}
    requires = EFFECTS[effect].requires
    model = vpm.Model.from_dict(content)
    return model if requires is None else model.with_effect(requires, at="shoulder", **SHOWN[requires])


def followed(model: vpm.Model, kind: str, step: float = 0.002) -> vpm.Experiment:
    """Five sines, the same slowly, or a chirp up to 40 Hz of equal acceleration, and the commands that it needs."""
    model = model.at("rigid") if model.beams else model
    if kind == "chirp":
        time = np.arange(0.0, 20.0, step)
        rate = 2.0 * np.pi * (1.0 + 39.0 * time / 20.0)
        q = 40.0 * np.sin(np.cumsum(rate) * step) / rate**2
        v, a = np.gradient(q, step), np.gradient(np.gradient(q, step), step)
    else:
        time = np.arange(0.0, 12.0, step)
        slow = 0.4 if kind == "slow" else 1.0
        sines = [(size, slow * rate, phase) for size, rate, phase in SINES]
        q, v, a = (sum(c * w**k * np.sin(w * time + p + k * np.pi / 2) for c, w, p in sines) for k in range(3))
    columns = [each[:, None] for each in (q, v, a, np.zeros(time.size))]
    required = model.core.inverse_dynamics(model.theta, *columns, step, [])[0]
    values = {"shoulder.position": q, "motor.command": required[:, 0] / 1.6}
    return vpm.Experiment.from_arrays(time, values, {"shoulder.position": "rad", "motor.command": "A"}, model=model)


def pumped(model: vpm.Model, step: float = 0.0005) -> vpm.Experiment:
    """The servo-cylinder under three sines of current, with its pressures, as the model simulates it."""
    time = np.arange(0.0, 2.0, step)
    current = 1e-3 * (1.2 * np.cos(9.0 * time) + 0.6 * np.sin(31.0 * time + 1.0) + 0.3 * np.sin(77.0 * time))
    given = vpm.Experiment.from_arrays(
        time,
        {"servo.command": current, "axis.position": 0.0 * time},
        {"servo.command": "A", "axis.position": "m"},
        model=model,
    )
    run = vpm.simulate(model, given, "free_run")
    shown = ("axis.position", "servo.pressure_a", "servo.pressure_b")
    values = {"servo.command": current, **{name: run[name] for name in shown}}
    units = {"servo.command": "A", "axis.position": "m", "servo.pressure_a": "Pa", "servo.pressure_b": "Pa"}
    return vpm.Experiment.from_arrays(time, values, units, model=model)


def motion_for(name: str) -> str:
    """The motion that shows an effect."""
    if EFFECTS[name].signature.lives_in[0] == "frequency":
        return "chirp"
    return "slow" if name == "backlash" else "sines"


def view(name: str) -> tuple[View, Array]:
    """The record as seen from the effect, and what the effect adds to the residual of the joint at every sample."""
    without = nominal(name)
    site = SITES[EFFECTS[name].site]
    model = without.with_effect(name, at=site, **SHOWN[name])
    if EFFECTS[name].site in HYDRAULIC:
        problem = InverseDynamicsProblem(without, [pumped(without)], cutoff=300.0)
        seen = View(model, (name, site), problem, 0, "servo.pressure_a", fine=True)
        return seen, seen.channel(without) - seen.channel(model)
    kind = motion_for(name)
    problem = InverseDynamicsProblem(without, [followed(without, kind)], cutoff=100.0 if kind == "chirp" else 40.0)
    seen = View(model, (name, site), problem, 0, "shoulder.effort", fine=True)
    return seen, seen.channel(without) - seen.channel(model)


@styled
def draw(name: str) -> Figure:
    """The signature of one effect over the state that it lives in."""
    seen, added = view(name)
    figure, axes = panels(1, height=2.0, width=5.0)
    axis = axes[0][0]
    kind, words, unit, values = seen.best(added, np.ones(added.size, dtype=np.bool_))
    if kind == "frequency":
        from scipy.signal import welch

        time = values
        values, power = welch(added, 1.0 / float(time[1] - time[0]), nperseg=2048)
        # A modelled beam without damping rings on at its first frequency, and at multiples of it where it bends far.
        shown = (values > 1.0) & (values < (10.0 if EFFECTS[name].site == "beam" else 36.0))
        values, added = values[shown], np.sqrt(power[shown])
        words, unit = "frequency", "Hz"
        axis.set_yscale("log")
    thin = slice(None, None, 1 if kind == "frequency" else 3)
    axis.plot(values[thin], added[thin], color=BLUE, linewidth=1.1)
    axis.axhline(0.0, color=SOFT, linewidth=0.7)
    axis.set_xlabel(label(words.replace(" of shoulder", "").replace(" of motor", ""), unit))
    effort = "Pa" if EFFECTS[name].site in HYDRAULIC else "N m"
    axis.set_ylabel(label("residual", f"{effort}/√Hz" if kind == "frequency" else effort))
    return figure


INTRODUCTION = """# The catalogue of effects

<!-- Written by docs/figures/effects.py (make figures) from vpm.catalogue.effects, a file each: change it there. -->

After this page you can write every effect in a [model file](model-file.md#effects) and recognise it in a residual. A
[diagnosis](diagnosis.md) tries these effects; [the physics](physics.md#2-effects) has their limits.

Each section has the law and its [source](physics.md#sources), a picture, the parameters (dotted suffix, unit, range,
default) and effects that records may confuse with it; what discriminates two stands once, at the first. *Slanted*
parameters shape a law whose size another one gives. Pictures show what the effect adds to the inverse-dynamics residual
of one link in gravity, or of a servo-cylinder.

tau is the effort that the effect adds, positive along the coordinate; q and v are coordinate and velocity of the joint,
u the command, x a true value, y its reading. Units: C is m or rad, E is N or N m, U the unit of the command, S that of
the sensor. Of two defaults the second is for joints that turn.

Effects marked *side* may sit behind the spring of a [joint_compliance](#joint_compliance) or [backlash](#backlash) of
their joint, by `side = "link"`. There q and v include the deflection. Those marked *spring* may sit in that spring
itself, by `at = "axis_deflection"`; q and v are the deflection alone. *Ranking*: only a [ranking](ranking.md) tries it.
"""


def page() -> str:
    """Text of docs/catalogue.md, a section for each entry."""
    lines = [INTRODUCTION]
    for site in dict.fromkeys(effect.site for effect in EFFECTS.values()):
        names = [f"[{e.name}](#{e.name})" for e in EFFECTS.values() if e.site == site]
        lines.append(f"- at {_article(site)}: {', '.join(names)}")
    for effect in EFFECTS.values():
        lines += ["", *_section(effect)]
    return "\n".join(lines) + "\n"


def _section(effect: EffectType) -> list[str]:
    signature = effect.signature
    lines = [
        f"## {effect.name}",
        "",
        f"At {_article(effect.site)}{_remarks(effect)}: `{effect.law}` ({source(effect)})",
        "",
    ]
    if effect.name in SHOWN:
        lines += [f"![{effect.title}](figures/effects/{effect.name}.svg)", ""]
    lines += [f"**Excite by** {signature.excite[0].lower()}{signature.excite[1:]}.", ""]
    lines += _parameters(effect)
    if effect.confused_with:
        lines += ["", _confused(effect)]
    return lines


def source(effect: EffectType) -> str:
    """Where the law comes from, which ends the docstring of the effect's file."""
    text = import_module(f"vpm.catalogue.effects.{effect.name}").__doc__ or ""
    _, found, where = text.partition("\nSource: ")
    if not found:
        raise ValueError(f"python/vpm/catalogue/effects/{effect.name}.py names no source; end its docstring with it")
    return where.strip().removesuffix(".")


def _remarks(effect: EffectType) -> str:
    remarks = []
    if effect.has_sides:
        remarks.append("*side*")
    if effect.in_springs:
        remarks.append("*spring*")
    if effect.requires:
        remarks.append(f"corrects [{effect.requires}](#{effect.requires}), which has to be there")
    if not effect.has_law:
        remarks.append("describes what no effect explains")
    return f" ({'; '.join(remarks)})" if remarks else ""


def _confused(effect: EffectType) -> str:
    """Effects that look alike; what discriminates two of them stands at the first."""
    told, links = [], []
    names = list(EFFECTS)
    for other, how in effect.confused_with.items():
        link = f"[{other}](#{other})"
        if names.index(other) < names.index(effect.name):
            links.append(link)
        else:
            told.append(f"- {link}: {how}")
    head = " ".join(["**Confused with**", *([", ".join(links)] if links else [])])
    return "\n".join([f"{head}, and:" if links else f"{head}:", "", *told]) if told else f"{head}."


def _article(site: str) -> str:
    if site == "world":
        return "the world"
    return f"an {site}" if site[0] in "aeiou" else f"a {site}"


def _parameters(effect: EffectType) -> list[str]:
    """A line for each parameter; coefficients of terms that the law lists share one line for each unit."""
    terms: dict[str, list[str]] = {}
    lines = []
    for parameter in effect.parameters:
        if parameter.meaning.startswith("coefficient of ") and parameter.suffix == f"{effect.group}.{parameter.name}":
            terms.setdefault(parameter.unit, []).append(f"`{parameter.name}`")
        else:
            lines.append(_line(effect, parameter))
    for unit, names in terms.items():
        lines.append(
            f"- {', '.join(names)} (`{effect.group}.` and the name, {_plain(unit)}): coefficients of their terms"
        )
    return lines


def _plain(unit: str) -> str:
    return unit.replace("{", "").replace("}", "")


def _line(effect: EffectType, parameter: EffectParameter) -> str:
    name = f"*`{parameter.name}`*" if parameter.shape else f"`{parameter.name}`"
    numbers = [*_bounds(parameter), *_default(parameter)]
    words = [f"`{parameter.suffix}`", _plain(parameter.unit)]
    alike = [
        (other.name, [*_bounds(one), *_default(one)])
        for other in EFFECTS.values()
        for one in other.parameters
        if (one.name, one.meaning) == (parameter.name, parameter.meaning)
    ]
    first, its_numbers = alike[0]
    if first == effect.name:
        return f"- {name} ({', '.join(words + numbers)}): {parameter.meaning}"
    return f"- {name} ({', '.join(words + numbers * (numbers != its_numbers))}): as of [{first}](#{first})"


def _bounds(parameter: EffectParameter) -> list[str]:
    low, high = parameter.physical
    if np.isinf(low) and np.isinf(high):
        return []
    if np.isinf(high):
        return ["> 0" if low > 0.0 else f"≥ {low:g}"]
    return [f"{low:.3g} to {high:.3g}"]


def _default(parameter: EffectParameter) -> list[str]:
    """Of what shapes a law alone: of the others a file has to give one at least."""
    if not parameter.shape or parameter.optional:
        return []
    shifts, turns = (parameter.default(kind) for kind in ("prismatic", "revolute"))
    if shifts is None or turns is None:
        return ["required"]
    if abs(shifts) > FAR:
        return ["by default none"]
    return [f"default {shifts:g}" if shifts == turns else f"default {shifts:g} or {turns:g}"]


def main(folder: Path) -> None:
    """Write the pictures, and the page beside their folder."""
    pictures = folder / "effects"
    pictures.mkdir(parents=True, exist_ok=True)
    for name in EFFECTS:
        if name in SHOWN:
            with rc_context({"svg.fonttype": "none", "svg.hashsalt": name}):
                draw(name).savefig(pictures / f"{name}.svg", metadata={"Date": None, "Creator": None})
            print(f"wrote {pictures / name}.svg")
    text = folder.parent / "catalogue.md"
    text.write_text(page(), encoding="utf-8", newline="\n")
    print(f"wrote {text}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
