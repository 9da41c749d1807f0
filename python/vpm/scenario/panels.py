"""What the picture of a scenario shows: channels, a list for each panel."""

from collections.abc import Mapping

from vpm.errors import near_match
from vpm.model import Model
from vpm.scenario.messages import refuse
from vpm.scenario.schema import Document

Panels = tuple[tuple[str, ...], ...]


def shown_channels(model: Model) -> Mapping[str, str]:
    """Channels that panels can show of a run, with SI units: outputs, and references it follows."""
    references = tuple(f"{name}.reference" for name in model.controlled_actuators)
    return {channel: model.channel_unit(channel) for channel in (*model.output_channels, *references)}


def checked_panels(document: Document, models: Mapping[str, Model]) -> Panels:
    """Panels of a scenario; by default positions of joints and forces of actuators, those of one unit together.

    A channel has to be there in one of the runs; others go without.
    """
    units = {channel: unit for model in models.values() for channel, unit in shown_channels(model).items()}
    if document.plot is None:
        return _usual(units, models)
    for number, channels in enumerate(document.plot.panels):
        for entry, channel in enumerate(channels):
            if channel not in units:
                repair = near_match(channel, units, what="their channels are")
                refuse(("plot", "panels", number, entry), f'is "{channel}", which is a channel of no run; {repair}')
        kinds = sorted({units[channel] for channel in channels})
        if len(kinds) > 1:
            rest = f"mixes channels in {' and '.join(kinds)}, which have no common axis; give each unit a panel"
            refuse(("plot", "panels", number), rest)
    return document.plot.panels


def checked_columns(document: Document, models: Mapping[str, Model]) -> Mapping[str, tuple[str, ...]]:
    """Runs of each column of panels, by its heading; empty where all runs share one."""
    columns = {} if document.plot is None else document.plot.columns
    for heading, names in columns.items():
        for entry, name in enumerate(names):
            if name not in models:
                repair = near_match(name, models, what="it has")
                refuse(("plot", "columns", heading, entry), f'is "{name}", which is no run of the scenario; {repair}')
    return columns


def _usual(units: Mapping[str, str], models: Mapping[str, Model]) -> Panels:
    joints = dict.fromkeys(f"{name}.position" for model in models.values() for name in model.joints)
    forces = dict.fromkeys(f"{name}.force" for model in models.values() for name in model.actuators)
    return tuple(
        tuple(channel for channel in group if units[channel] == unit)
        for group in (joints, forces)
        for unit in dict.fromkeys(units[channel] for channel in group)
    )
