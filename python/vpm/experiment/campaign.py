"""Several records of one campaign as one object, and its honest division into what is fitted and what judges."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from glob import glob, has_magic
from os import PathLike
from pathlib import Path
from typing import Literal, Self, overload

from vpm.errors import ExperimentError, check_known, near_match
from vpm.experiment.readers.base import reading
from vpm.experiment.readers.lerobot import episodes_of, is_data_set
from vpm.experiment.record import Experiment
from vpm.files import exists
from vpm.model import ChannelEntry, Model
from vpm.results import Result


def as_records(experiments: Experiment | Sequence[Experiment]) -> list[Experiment]:
    """Records of a campaign in a list, where one alone may be given."""
    return [experiments] if isinstance(experiments, Experiment) else list(experiments)


@dataclass(frozen=True, repr=False, eq=False)
class Campaign(Result, Sequence[Experiment]):
    """Records of one machine in their order: a sequence of experiments that also knows them by name.

    It stands wherever a sequence of experiments does. All records have the same channels in the same units; rates and
    durations may differ.

    Raises
    ------
    ExperimentError
        There is no record, a name stands twice, or channels or units differ.
    """

    experiments: tuple[Experiment, ...]

    def __post_init__(self) -> None:
        """Check that the campaign's records belong together."""
        object.__setattr__(self, "experiments", tuple(self.experiments))
        if not self.experiments:
            raise ExperimentError("a campaign has at least one record, and none was given; name its files")
        first = self.experiments[0]
        for at, record in enumerate(self.experiments):
            if record.name in self.names[:at]:
                raise ExperimentError(
                    f'records {self.names.index(record.name) + 1} and {at + 1} of the campaign are both named "'
                    f'{record.name}"; give one of them another name'
                )
            check_channels(first, record)

    @classmethod
    def load(
        cls,
        paths: str | PathLike[str] | Sequence[str | PathLike[str]],
        channels: Mapping[str, ChannelEntry] | str | PathLike[str] | None = None,
        model: Model | None = None,
        *,
        irregular: Literal["error", "interpolate"] = "error",
        resample: float | None = None,
        common: bool = False,
    ) -> Self:
        """Read the files of a campaign with one channel table.

        Parameters
        ----------
        paths : path-like or sequence of path-like
            Files, or patterns such as ``"logs/2024-05-*.mat"``, whose files are taken in the order of their names. A
            single ``.npz`` that holds a campaign is read as `save` wrote it.
        channels, model, irregular, resample
            As in `Experiment.load`.
        common : bool
            Keep only the channels that every file has; otherwise files that differ are refused.

        Raises
        ------
        ExperimentError
            No file fits a pattern, a file cannot be right, or the files do not belong together.
        """
        given = [paths] if isinstance(paths, str | PathLike) else list(paths)
        files = [file for path in given for file in files_of(path)]
        if len(files) == 1 and files[0].suffix == ".npz":
            stored = Result.load(files[0])
            if isinstance(stored, cls):
                return stored
        records = [
            Experiment.load(file, channels, model, irregular=irregular, resample=resample, name=name)
            for file, name in zip(files, record_names(files), strict=True)
        ]
        return cls(tuple(shared(records) if common else records))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the records of a campaign."""
        return tuple(record.name for record in self.experiments)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels that every record of a campaign has."""
        return self.experiments[0].channels

    @property
    def duration(self) -> float:
        """Time of all records of a campaign together, s."""
        return sum(record.duration for record in self.experiments)

    def __len__(self) -> int:
        """Count of a campaign's records."""
        return len(self.experiments)

    def __iter__(self) -> Iterator[Experiment]:
        """Records of a campaign in their order."""
        return iter(self.experiments)

    @overload
    def __getitem__(self, at: int | str) -> Experiment: ...
    @overload
    def __getitem__(self, at: slice) -> Self: ...
    def __getitem__(self, at: int | str | slice) -> Experiment | Self:
        """A record by its place or name, or a campaign of some of them by a slice."""
        if isinstance(at, str):
            return self.experiments[self._place(at)]
        return type(self)(self.experiments[at]) if isinstance(at, slice) else self.experiments[at]

    def split(
        self,
        train: float | str | Sequence[str] | None = None,
        validation: float | str | Sequence[str] | None = None,
        *,
        gap: float = 0.0,
    ) -> tuple[Self, Self]:
        """Training and validation campaign, by whole records or by time; never by single samples.

        Neighbouring samples of a record are almost equal. A model that is judged on samples next to those that it was
        fitted to is judged on what it has seen.

        Parameters
        ----------
        train, validation : float, or str or sequence of str, optional
            Shares between 0 and 1: the first part of every record and its last part. Names, or patterns such as
            ``"sine*"``: whole records. What is not given is the rest.
        gap : float
            Time between both parts of a record that belongs to neither, s; longer than the machine remembers.

        Returns
        -------
        train, validation : Campaign

        Raises
        ------
        ExperimentError
            Nothing is left for one part, both share something, or a name is unknown.
        """
        given = [part for part in (train, validation) if part is not None]
        if not given:
            raise ExperimentError('a split needs a share or names; give train=0.7, or validation="NAME"')
        if all(isinstance(part, float | int) for part in given):
            return self._split_time(train, validation, gap)  # type: ignore[arg-type]  # narrowed by all()
        if any(isinstance(part, float | int) for part in given):
            raise ExperimentError("a split is by shares of time or by names of records; give both parts alike")
        if gap:
            raise ExperimentError(f"a gap of {gap:g} s has no meaning between whole records; leave it out")
        fitted = self._chosen(train, "train")
        unseen = self._chosen(validation, "validation")
        fitted = fitted if train is not None else [name for name in self.names if name not in unseen]
        unseen = unseen if validation is not None else [name for name in self.names if name not in fitted]
        both = [name for name in fitted if name in unseen]
        if both:
            raise ExperimentError(f'the record "{both[0]}" is in both parts of the split; name it once')
        for part, chosen in (("training", fitted), ("validation", unseen)):
            if not chosen:
                raise ExperimentError(f"no record is left for {part}; name fewer of {', '.join(self.names)}")
        return tuple(  # type: ignore[return-value]  # two of them
            type(self)(tuple(self[name] for name in chosen)) for chosen in (fitted, unseen)
        )

    def _split_time(self, train: float | None, validation: float | None, gap: float) -> tuple[Self, Self]:
        first = train if train is not None else 1.0 - float(validation or 0.0)
        last = validation if validation is not None else 1.0 - first
        if not (0.0 < first < 1.0 and 0.0 < last < 1.0 and first + last <= 1.0 + 1e-9 and gap >= 0.0):
            raise ExperimentError(
                f"shares of {first:g} and {last:g} with a gap of {gap:g} s are no split; give shares between 0 and 1 "
                "that are together at most 1, and a gap of at least 0"
            )
        parts: tuple[list[Experiment], list[Experiment]] = ([], [])
        for record in self.experiments:
            start, end = float(record.time[0]), float(record.time[-1])
            border = start + first * (end - start)
            behind = max(border + gap + 0.5 * record.dt, end - last * (end - start))
            if behind >= end:
                raise ExperimentError(
                    f"{record.name}: the first {first:g} of {end - start:g} s and a gap of {gap:g} s leave nothing; "
                    "give a smaller share or a shorter gap"
                )
            for part, label, piece in zip(
                parts,
                ("train", "validation"),
                (record.trim(start, border - 1e-5 * record.dt), record.trim(behind, end)),
                strict=True,
            ):
                part.append(piece.renamed(f"{record.name}-{label}"))
        return type(self)(tuple(parts[0])), type(self)(tuple(parts[1]))

    def _chosen(self, wanted: float | str | Sequence[str] | None, part: str) -> list[str]:
        if wanted is None or isinstance(wanted, float | int):
            return []
        patterns = [wanted] if isinstance(wanted, str) else list(wanted)
        chosen: list[str] = []
        for pattern in patterns:
            found = [name for name in self.names if name == pattern or fnmatchcase(name, pattern)]
            if not found:
                raise ExperimentError(
                    f'{part}: no record is named "{pattern}"; {near_match(pattern, self.names, what="there are")}'
                )
            chosen += [name for name in found if name not in chosen]
        return [name for name in self.names if name in chosen]

    def _place(self, name: str) -> int:
        check_known([name], self.names, ExperimentError, "the campaign has no record", what="there are")
        return self.names.index(name)

    def _headline(self) -> Mapping[str, object]:
        return {"records": self.names, "seconds": self.duration, "channels": self.channels}

    def _html_rows(self) -> Mapping[str, object]:
        return {
            record.name: f"{len(record)} samples, {record.duration:.6g} s at {record.rate:.6g} Hz"
            for record in self.experiments
        }

    def _frame_columns(self) -> Mapping[str, object]:
        return {
            "name": list(self.names),
            "samples": [len(record) for record in self.experiments],
            "duration_s": [record.duration for record in self.experiments],
            "rate_Hz": [record.rate for record in self.experiments],
        }


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
