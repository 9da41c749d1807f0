"""Another drive in the place of a servo-cylinder: an element for it and its controller, or a table of its force.

The laws of these drives are in docs/maxwell_narx.md, docs/narx.md and docs/hydraulics.md.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vpm.catalogue import effects_for_site
from vpm.errors import ModelError
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.simplify.reductions import Reduction

#: The drive that stands for the cylinder alone: its controller stays. All others stand for both.
TABLE = "table"
#: What sensors can still show of a drive without spool and pressures.
STILL_MEASURED = ("command", "force")
#: Parts of a model file that one without such parts does not have.
OPTIONAL = ("controllers", "supplies", "effects", "sensors")


@dataclass(frozen=True)
class Replacement(Reduction):
    """Another drive in the place of a servo-cylinder: ``narx``, ``maxwell_narx`` or ``table``."""

    entry: str = ""  #: The actuator of the model file as JSON, without what it acts on.

    def __str__(self) -> str:
        """Label of a replacement."""
        return f"{self.at} as {self.name}"

    def applied(self, model: Model) -> Model:
        """Model with a replacement in the place of its servo-cylinder."""
        return replaced(model, self.at, self.entry)


def replaced(model: Model, drive: str, entry: str) -> Model:
    """Model with another drive in the place of a servo-cylinder.

    A table gets the commands of the controller. What is no table stands for the controller too, and its command is the
    reference.

    ``entry``: the other drive as JSON, without the joint or line that it acts on.
    """
    content, other = model.to_dict(), json.loads(entry)
    place = {key: value for key, value in content["actuators"][drive].items() if key in ("joint", "line")}
    content["actuators"][drive] = {**place, **other}
    lost = tuple(effect.name for effect in effects_for_site("cylinder"))
    if other["type"] != TABLE:
        lost = tuple(effect.name for effect in model.effects if effect.at == drive)
        content["controllers"] = _without_controller(model, content.get("controllers", {}), drive)
    used = {each.get("supply") for each in content["actuators"].values()}
    gone = set(model.supplies) - used
    content["supplies"] = {name: each for name, each in content["supplies"].items() if name in used}
    content["effects"] = [
        effect
        for effect in content.get("effects", ())
        if effect["at"] not in gone and not (effect["at"] == drive and effect["type"] in lost)
    ]
    content["sensors"] = _kept_sensors(content.get("sensors", {}), {drive, *gone})
    return type(model)({key: each for key, each in content.items() if each or key not in OPTIONAL})


def commanded(model: Model, full: Model, record: Experiment) -> Experiment:
    """Record for replaced drives: the reference of each that lost its controller is its command."""
    lost = [name for name in full.controlled_actuators if name not in model.controlled_actuators]
    if not lost:
        return record
    values = {name: record[name] for name in record.channels if not name.startswith(tuple(f"{x}." for x in lost))}
    kept = {name: record[name] for name in record.channels if name not in values and name in model.output_channels}
    commands = {f"{name}.command": record[f"{name}.reference"] for name in lost}
    return Experiment.from_arrays(record.time, {**values, **kept, **commands}, model=model, name=record.name)


def _without_controller(model: Model, controllers: Mapping[str, Any], drive: str) -> dict[str, Any]:
    alone = {name for name, controller in controllers.items() if controller.get("actuator") == drive}
    if drive in model.controlled_actuators and not alone:
        raise ModelError(
            f"the controller of {drive} commands other drives as well, so that no element can stand for both; "
            "give each drive a controller of its own"
        )
    return {name: controller for name, controller in controllers.items() if name not in alone}


def _kept_sensors(sensors: Mapping[str, Any], gone: set[str]) -> dict[str, Any]:
    parts = {name: str(sensor["measures"]).rpartition(".") for name, sensor in sensors.items()}
    kept = (name for name, (owner, _, what) in parts.items() if owner not in gone or what in STILL_MEASURED)
    return {name: sensors[name] for name in kept}
