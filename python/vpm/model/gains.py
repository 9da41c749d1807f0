"""The parameters of controllers: gains and limits with their units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from vpm.model.controller import Cascade, ComputedTorque, Controller, ForceLoop, Pd, Pid
from vpm.model.entry import Quantity
from vpm.model.structure import EFFORT_UNIT, Structure


@dataclass(frozen=True)
class Gain:
    """A number of a controller: the end of its dotted name, the way to it in the table, what stands there, its unit."""

    suffix: str
    way: tuple[str | int, ...]
    quantity: Quantity
    unit: str
    is_limit: bool = False


def gains(controller: Controller, structure: Structure) -> Iterator[Gain]:
    """Every number of a controller that is a parameter, limits last.

    Parameters
    ----------
    controller : Controller
        Its references have to be right.
    structure : Structure

    Yields
    ------
    Gain
    """
    commands = [structure.document.actuators[actuator].command_unit for actuator, _ in controller.pairs]
    if isinstance(controller, ComputedTorque):
        for key, unit in (("proportional", "1/s^2"), ("derivative", "1/s")):
            for i, (joint, quantity) in enumerate(zip(controller.joints, getattr(controller, key), strict=True)):
                yield Gain(f"{key}.{joint}", (key, i), quantity, unit)
        for i, (joint, quantity) in enumerate(zip(controller.joints, controller.limit or (), strict=False)):
            yield Gain(f"limit.{joint}", ("limit", i), quantity, commands[i], is_limit=True)
        return
    units = _units(controller, commands[0], structure)
    for key in controller.GAINS:
        yield Gain(key, (key,), getattr(controller, key), units[key])
    if controller.limit is not None:
        yield Gain("limit", ("limit",), controller.limit, commands[0], is_limit=True)


def _units(controller: Cascade | Pid | Pd | ForceLoop, command: str, structure: Structure) -> dict[str, str]:
    held = structure.unit(controller.measures)
    if isinstance(controller, ForceLoop):
        effort = EFFORT_UNIT[structure.joint_kind(controller.measures.partition(".")[0])]
        entry = structure.document.actuators[controller.actuator]
        stroke = held if entry.joint is not None else "m" if entry.line is not None else "rad"
        per_force = f"({command})/({structure.effort_unit(controller.actuator)})"
        return {
            "proportional": f"({effort})/({held})",
            "derivative": f"({effort}) s/({held})",
            "feed_forward": per_force,
            "force_gain": per_force,
            "velocity_gain": f"({command}) s/({stroke})",
        }
    return {
        "position_gain": "1/s",
        "velocity_gain": f"({command}) s/({held})",
        "proportional": f"({command})/({held})",
        "integral": f"({command})/({held} s)",
        "derivative": f"({command}) s/({held})",
    }
