"""Models as C99: rates, outputs, exact derivatives and steps, for controllers, CasADi and acados."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import filter as matching
from os import PathLike
from pathlib import Path

from vpm.errors import SimulationError, near_match, refused_as
from vpm.files import make_folder, write_text
from vpm.model import Model


@dataclass(frozen=True)
class CSource:
    """A model in C: one header, one source, nothing but ``math.h``.

    Attributes
    ----------
    name : str
        Begins every name in C.
    header, source : str
        The texts of ``NAME.h`` and ``NAME.c``.
    parameters : tuple of str
        Those that are arguments of the functions, in order.
    """

    name: str
    header: str
    source: str
    parameters: tuple[str, ...]

    def entries(self, what: str, by: str) -> list[tuple[int, int]]:
        """Nonzero entries of a derivative in the C source, column by column.

        ``what``: one of "rates", "outputs"; ``by``: one of "x", "u", "p".
        """
        # The tables are CasADi's: rows, columns, where each column begins and the last ends, the row of each entry.
        table = re.search(rf"{self.name}_{what}_by_{by}\[\] = \{{([^}}]*)\}};", self.source)
        numbers = [int(number) for number in table[1].split(",")] if table else [0, 0, 0]
        columns = numbers[1]
        first, rows = numbers[2 : 3 + columns], numbers[3 + columns :]
        return [(row, column) for column in range(columns) for row in rows[first[column] : first[column + 1]]]

    def save(self, folder: str | PathLike[str]) -> tuple[Path, Path]:
        """Save the C source: ``NAME.h`` and ``NAME.c`` in a folder, which is made if it is not there."""
        target = make_folder(folder)
        return write_text(target / f"{self.name}.h", self.header), write_text(target / f"{self.name}.c", self.source)


def c_source(model: Model, *, name: str | None = None, parameters: Sequence[str] = ()) -> CSource:
    """Write a model's equations out in C99.

    Delays pass their signals unchanged, as in :meth:`vpm.Model.linearize`; outputs are what sensors show.

    Parameters
    ----------
    name : str, optional
        Begins every name in C; made of the model's name by default.
    parameters : sequence of str
        Names of parameters, or patterns such as ``"*.mass"``, that stay arguments of the functions. All others become
        constants: the fewer stay, the less there is to compute.

    Raises
    ------
    SimulationError
        A parameter is unknown, the name is none of C, or the equations of the model cannot be written out.
    """
    known = list(model.parameters)
    free: list[str] = []
    for pattern in parameters:
        found = matching(known, pattern)
        if not found:
            raise SimulationError(f"the model has no parameter `{pattern}`; {near_match(pattern, known)}")
        free.extend(one for one in found if one not in free)
    free.sort(key=model.index)
    identifier = re.sub(r"\W", "_", model.name, flags=re.ASCII) if name is None else name
    names = (list(model.state_names), list(model.inputs), list(model.output_channels))
    with refused_as(SimulationError):
        header, source = model.core.c_source(model.theta, identifier, *names, [model.index(one) for one in free])
    return CSource(identifier, header, source, tuple(free))
