"""What drives deliver along a measured motion, and what it needs, remembered: most questions are asked again.

Along a given motion no joint effect, mass or inertia changes what a drive does, and no drive the effort that the
motion needs. A search that tries them one after the other would let the same drives run through the same record, and
work out the same efforts, every time.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from copy import copy
from dataclasses import dataclass
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from vpm.simulate import AUTOMATIC

Array = NDArray[np.float64]

#: Answers that are kept for each record: what one round of a search asks, the next one asks again.
KEPT = 400
#: Numbers that are kept for each record; the answer asked for last stays whatever its size.
MOST_NUMBERS = 20_000_000


Filter = Callable[[Array], Array]


@dataclass(frozen=True)
class Answer:
    """Outputs (n, k) and the derivatives (n, k) of these by parameter name, both filtered."""

    outputs: Array
    slopes: dict[str, Array]

    @property
    def numbers(self) -> int:
        """How many numbers it holds."""
        return self.outputs.size * (1 + len(self.slopes))


class DriveMemory:
    """Answers of drives to one record by what they depend on; safe to be used by several threads.

    Parameters
    ----------
    keep : callable
        Filter of a record, from (N, k) to the (n, k) that are compared.
    integrator : str, optional
        How drives are run along the motion, as `vpm.simulate.Setup` names it.
    """

    def __init__(self, keep: Filter, integrator: str = AUTOMATIC) -> None:
        self.keep, self.integrator = keep, integrator
        #: Which commands the drives are given: 0 for those of the record.
        self.commands = 0
        self._lock = Lock()
        self._answers: OrderedDict[Hashable, Answer] = OrderedDict()
        #: How many numbers the answers hold; in a list, for it is one memory whatever the commands.
        self._numbers = [0]

    def take(self, integrator: str) -> None:
        """Run drives in another way from here on."""
        with self._lock:
            self.integrator = integrator
            self._answers.clear()
            self._numbers[0] = 0

    def under(self, commands: int) -> DriveMemory:
        """The same memory, asked about drives that are given other commands."""
        other = copy(self)
        other.commands = commands
        return other

    def recall(
        self, key: Hashable, names: Sequence[str], work: Callable[[Sequence[str]], tuple[Array, Array]]
    ) -> tuple[Array, Array]:
        """Filtered outputs (n, k) and derivatives (n, k, names); ``work`` gives unfiltered ones that are not known."""
        with self._lock:
            known = self._answers.get(key)
            if known is not None:
                self._answers.move_to_end(key)
        missing = [name for name in names if known is None or name not in known.slopes]
        if known is None or missing:
            outputs, slopes = work(missing)
            known = self._filtered(known, outputs, slopes, missing)
            self._keep(key, known)
        columns = [known.slopes[name] for name in names]
        empty = np.zeros((*known.outputs.shape, 0))
        return known.outputs, np.stack(columns, axis=-1) if columns else empty

    def _filtered(self, known: Answer | None, outputs: Array, slopes: Array, names: Sequence[str]) -> Answer:
        """What was known with what is new, all of which passes the filter side by side."""
        fresh = [] if known else [outputs]
        fresh += [slopes[:, :, place] for place in range(len(names))]
        kept = np.split(self.keep(np.hstack(fresh)), len(fresh), axis=1) if fresh else []
        first = known.outputs if known else np.ascontiguousarray(kept.pop(0))
        new = {name: np.ascontiguousarray(column) for name, column in zip(names, kept, strict=True)}
        return Answer(first, {**(known.slopes if known else {}), **new})

    def _keep(self, key: Hashable, answer: Answer) -> None:
        with self._lock:
            # What is read elsewhere is never changed: an answer that learnt more takes its place.
            before = self._answers.pop(key, None)
            self._answers[key] = answer
            self._numbers[0] += answer.numbers - (before.numbers if before else 0)
            while len(self._answers) > KEPT or (self._numbers[0] > MOST_NUMBERS and len(self._answers) > 1):
                _, oldest = self._answers.popitem(last=False)
                self._numbers[0] -= oldest.numbers
