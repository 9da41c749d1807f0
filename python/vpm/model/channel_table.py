"""Channel tables as files of their own: the same as ``[channels]`` of a model file."""

from collections.abc import Mapping
from os import PathLike
from types import MappingProxyType

from pydantic import TypeAdapter, ValidationError

from vpm.model.channels import ChannelEntry
from vpm.model.form import schema_problems
from vpm.model.messages import raise_first
from vpm.model.reading import read_toml

_TABLE = TypeAdapter(dict[str, ChannelEntry])


def parse_channel_table(content: Mapping[str, object], *, path: str | None = None) -> Mapping[str, ChannelEntry]:
    """Check a channel table that was parsed from TOML.

    - ``content``: channel names (and ``"time"``) to tables; or all of that under the key ``channels``
    - ``path``: file that it comes from, for messages
    """
    table = content.get("channels", content) if set(content) == {"channels"} else content
    try:
        return MappingProxyType(_TABLE.validate_python(table))
    except ValidationError as error:
        raise_first(schema_problems(error, within=("channels",)), path)


def load_channel_table(path: str | PathLike[str]) -> Mapping[str, ChannelEntry]:
    """Read a channel table from a TOML file of its own."""
    return parse_channel_table(read_toml(path), path=str(path))
