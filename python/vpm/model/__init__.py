"""Models: what a machine is made of, read from a TOML file and checked before anything moves."""

from vpm.model.channel_table import load_channel_table, parse_channel_table
from vpm.model.channels import ChannelEntry
from vpm.model.compile import Shape
from vpm.model.dynamics import Dynamics
from vpm.model.effects import Effect
from vpm.model.model import Model
from vpm.model.parameters import Parameter

__all__ = [
    "ChannelEntry",
    "Dynamics",
    "Effect",
    "Model",
    "Parameter",
    "Shape",
    "load_channel_table",
    "parse_channel_table",
]
