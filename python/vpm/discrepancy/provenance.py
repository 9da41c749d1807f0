"""Provenance of a diagnosis: program, files with checksums, and settings that differ from the defaults."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from pathlib import Path

from vpm.experiment import Experiment
from vpm.model import Model
from vpm.results import Storable
from vpm.sending import vpm_version


@dataclass(frozen=True, repr=False, eq=False)
class Source(Storable):
    """Source file in the provenance of a diagnosis.

    Attributes
    ----------
    role : {"model", "fitted", "unseen"}
    name : str
    path : str
        File; empty for what was made in a program.
    sha256 : str
        Of the file, or of the text or the numbers of what was made in a program.
    """

    role: str
    name: str
    path: str
    sha256: str


@dataclass(frozen=True, repr=False, eq=False)
class Provenance(Storable):
    """Provenance of a diagnosis: program, versions, sources and settings.

    Attributes
    ----------
    version : str
        Of vpm.
    date : str
        When it ended, UTC.
    command : str
    sources : tuple of Source
    settings : dict of str to str
        Those that differ from their defaults.
    """

    version: str
    date: str
    command: str
    sources: tuple[Source, ...]
    settings: dict[str, str]


def provenance(
    model: Model,
    fitted: Sequence[Experiment],
    validation: Sequence[Experiment],
    command: str,
    settings: Mapping[str, tuple[object, object]],
) -> Provenance:
    """Provenance of the diagnosis that runs now.

    - ``settings``: value and default of each
    """
    text = model.to_toml().encode()
    sources = [Source("model", model.name, model.path or "", _checksum(model.path, text))]
    for role, records in (("fitted", fitted), ("unseen", validation)):
        sources += [Source(role, e.name, e.path or "", _checksum(e.path, _numbers(e))) for e in records]
    changed = {name: repr(value) for name, (value, default) in settings.items() if value != default}
    return Provenance(vpm_version(), f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC", command, tuple(sources), changed)


def own_settings(given: object, name: str) -> dict[str, tuple[object, object]]:
    """Settings of a dataclass with their defaults, for `provenance`."""
    usual = type(given)()
    return {f"{name}.{f.name}": (getattr(given, f.name), getattr(usual, f.name)) for f in fields(given)}  # type: ignore[arg-type]


def _checksum(path: str | None, otherwise: bytes) -> str:
    """Checksum of a source file for the provenance; of ``otherwise`` where no file exists."""
    try:
        content = otherwise if path is None else Path(path).read_bytes()
    except OSError:
        content = otherwise
    return hashlib.sha256(content).hexdigest()


def _numbers(record: Experiment) -> bytes:
    return record.time.tobytes() + record.data.tobytes()
