"""Which files make a campaign, what their records are called, and whether they belong together."""

from collections import Counter
from collections.abc import Sequence
from glob import glob, has_magic
from os import PathLike
from pathlib import Path

from vpm.errors import ExperimentError
from vpm.experiment.readers.base import reading
from vpm.experiment.readers.lerobot import episodes_of, is_data_set
from vpm.experiment.record import Experiment
from vpm.files import exists


def check_channels(first: Experiment, record: Experiment) -> None:
    """Refuse a record as a member whose channels or units are not those of the first."""
    for one, other in ((first, record), (record, first)):
        lost = [channel for channel in one.channels if channel not in other]
        if lost:
            raise ExperimentError(
                f'{other.name} has no channel "{lost[0]}", which {one.name} has; map the same channels in every file, '
                "mark it optional in the channel table if zeros are meant, or load with common=True",
                channel=lost[0],
            )
    for channel in first.channels:
        if first.unit(channel) != record.unit(channel):
            raise ExperimentError(
                f'"{channel}" is in {first.unit(channel)} in {first.name} and in {record.unit(channel)} in '
                f"{record.name}; state its unit in one channel table for all files",
                channel=channel,
            )


def shared(records: Sequence[Experiment]) -> list[Experiment]:
    """Member records with the channels that all of them have, in the order of the first."""
    common = [channel for channel in records[0].channels if all(channel in record for record in records)]
    return [record.select(common) for record in records]


def files_of(path: str | PathLike[str]) -> list[Path]:
    """Member files: one, all that fit a pattern by name, or the episodes of a LeRobot data set."""
    if is_data_set(path):
        with reading(path):
            return episodes_of(path)
    if not has_magic(str(path)) or exists(path):
        return [Path(path)]
    found = sorted(glob(str(path), recursive=True))  # noqa: PTH207  Path.glob refuses absolute patterns
    if not found:
        raise ExperimentError(f'no file fits the pattern "{path}"; check the folder', path=str(path))
    return [Path(file) for file in found]


def record_names(files: Sequence[Path]) -> list[str]:
    """Names of member files without their ending, with the folder where that alone discriminates."""
    counts = Counter(file.stem for file in files)
    return [file.stem if counts[file.stem] == 1 else f"{file.parent.name}/{file.stem}" for file in files]
