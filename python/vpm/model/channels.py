"""How the columns of a log map on the channels of a model: ``[channels]`` of a model file, or a file of its own.

The value of a channel is ``scale column + offset``, in ``unit``; the samples are stamped ``delay`` seconds late.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from types import MappingProxyType
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from vpm.model.messages import raise_first, read_toml, schema_problems
from vpm.units import parse_unit

_Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
_Text = Annotated[str, Field(strict=True, min_length=1)]


def _not_zero(value: float) -> float:
    if value == 0.0:
        raise ValueError("is 0, which would erase the column; give another factor")
    return value


def _readable(unit: str) -> str:
    parse_unit(unit)
    return unit


class ChannelEntry(BaseModel):
    """Column of a log that holds one channel.

    Attributes
    ----------
    column : str
        Name of the column.
    unit : str
        Unit of ``scale column + offset``.
    scale : float
        Factor on the numbers of the column.
    offset : float
        Added after the scaling, in `unit`.
    delay : float
        How late the samples are stamped (s).
    optional : bool
        A log without the column holds zeros here.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    column: _Text
    unit: Annotated[_Text, AfterValidator(_readable)]
    scale: Annotated[_Number, AfterValidator(_not_zero)] = 1.0
    offset: _Number = 0.0
    delay: _Number = 0.0
    optional: Annotated[bool, Field(strict=True)] = False


_TABLE = TypeAdapter(dict[str, ChannelEntry])


def parse_channel_table(content: Mapping[str, object], *, path: str | None = None) -> Mapping[str, ChannelEntry]:
    """Check a channel table.

    Parameters
    ----------
    content : mapping
        Channel names (and ``"time"``) to tables; or all of that under the key ``channels``.
    path : str, optional
        File that it comes from, for messages.

    Returns
    -------
    mapping of str to ChannelEntry

    Raises
    ------
    ModelError
        A key is unknown or missing, or a value is of the wrong kind.
    """
    table = content.get("channels", content) if set(content) == {"channels"} else content
    try:
        return MappingProxyType(_TABLE.validate_python(table))
    except ValidationError as error:
        raise_first(schema_problems(error, within=("channels",)), path)


def load_channel_table(path: str | PathLike[str]) -> Mapping[str, ChannelEntry]:
    """Read a channel table from a TOML file of its own.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    mapping of str to ChannelEntry

    Raises
    ------
    ModelError
        The file cannot be read, is no TOML, or is not a channel table.
    """
    return parse_channel_table(read_toml(path), path=str(path))
