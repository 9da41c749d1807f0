"""What every reader of logs offers: names of columns, and their numbers."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike

from vpm.errors import ExperimentError, VpmError
from vpm.experiment.table import Table, missing_column


@contextmanager
def reading(path: str | PathLike[str], kind: str = "") -> Iterator[None]:
    """Context for every reader's parser: whatever it raises about a broken file becomes one sentence."""
    try:
        yield
    except VpmError:
        raise
    except Exception as error:  # parsers raise what they stumble over
        raise broken(path, kind, error) from error


def broken(path: str | PathLike[str], kind: str, error: Exception | str) -> ExperimentError:
    """Error for a file that its parser does not take.

    ``kind``: as ``"a TDMS file"``; "" where nobody knows yet.
    """
    told = str(error).strip().splitlines()
    reason = (told[0] if told else type(error).__name__)[:200]
    return ExperimentError(
        f"{path} cannot be read{f' as {kind}' if kind else ''} ({reason}); check that it was closed when it was "
        "written, and that its ending says what it is",
        path=str(path),
    )


class Log(ABC):
    """A file of a log.

    Attributes
    ----------
    header : tuple of str
        Names of all columns of numbers.
    refused : dict of str to str
        What else is in the file, and why it is no column of numbers, as the end of a sentence with the repair.
    units : dict of str to str
        Units that the file itself states.
    bracketed_units : bool
        Whether brackets behind a name hold a unit, ``q [deg]``; in the other formats they hold an index.
    """

    header: tuple[str, ...]
    bracketed_units = False

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path = path
        self.refused: dict[str, str] = {}
        self.units: dict[str, str] = {}

    def find(self, column: str) -> str | None:
        """Name in `header` of what a channel table calls ``column``; None where the file does not have it.

        A table may leave out the unit that the header states in brackets.
        """
        if column in self.header:
            return column
        named = [name for name in self.header if self.bracketed_units and bracketed(name)[0] == column]
        return named[0] if len(named) == 1 else None

    def read(self, columns: Sequence[str], clock: str) -> Table:
        """Read columns by their names in the header, the base of every reader.

        Parameters
        ----------
        columns : sequence of str
            The clock among them.
        clock : str
            The column that holds the time.

        Raises
        ------
        ExperimentError
            A column holds something that is no number, their lengths differ, or the file is broken.
        """
        with reading(self.path):
            return self._read(columns, clock)

    @abstractmethod
    def _read(self, columns: Sequence[str], clock: str) -> Table:
        """Columns by their names, as every reader gives them; see `read`."""

    def missing(self, column: str, channel: str = "") -> ExperimentError:
        """Base error of readers for a column that the file does not have, or that has no numbers."""
        reason = self.refused.get(column)
        if reason is None:
            return missing_column(self.path, column, self.header, channel)
        use = f' for the channel "{channel}"' if channel else ""
        return self.error(f'{self.path}: "{column}"{use} {reason}', channel)

    def error(self, message: str, channel: str = "") -> ExperimentError:
        """Base error of readers about a log, with the path of its file."""
        return ExperimentError(message, path=str(self.path), channel=channel or None)


def bracketed(column: str) -> tuple[str, str]:
    """Name and unit of ``q [mm]``; no unit without brackets."""
    name, bracket, rest = column.partition("[")
    return (name.strip(), rest[:-1].strip()) if bracket and rest.endswith("]") else (column, "")
