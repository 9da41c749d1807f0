"""What drives with states of their own answer to a measured motion, remembered: most questions are asked again.

Along a given motion no joint effect, mass or inertia changes what a drive does, and no cylinder the effort that the
motion needs. A search that tries them one after the other would let the same drives run through the same record, and
work out the same efforts, every time.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from vpm.simulate import AUTOMATIC

Array = NDArray[np.float64]

#: Answers that are kept for each record: what one round of a search asks, the next one asks again.
KEPT = 400


Filter = Callable[[Array], Array]


@dataclass(frozen=True)
class Answer:
    """Outputs (n, k) and the derivatives (n, k) of these by parameter name, both filtered."""

    outputs: Array
    slopes: dict[str, Array]


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
        self._lock = Lock()
        self._answers: OrderedDict[Hashable, Answer] = OrderedDict()

    def take(self, integrator: str) -> None:
        """Run drives in another way from here on."""
        with self._lock:
            self.integrator = integrator
            self._answers.clear()

    def recall(
        self, key: Hashable, names: Sequence[str], work: Callable[[Sequence[str]], tuple[Array, Array]]
    ) -> tuple[Array, Array]:
        """Filtered outputs (n, k) and derivatives (n, k, names); ``work`` gives unfiltered ones that are not known."""
        with self._lock:
            known = self._answers.get(key)
        missing = [name for name in names if known is None or name not in known.slopes]
        if known is None or missing:
            outputs, slopes = work(missing)
            before = known.slopes if known else {}
            new = {name: self.keep(slopes[:, :, place]) for place, name in enumerate(missing)}
            known = Answer(known.outputs if known else self.keep(outputs), {**before, **new})
        with self._lock:
            # What is read elsewhere is never changed: an answer that learnt more takes its place.
            self._answers[key] = known
            self._answers.move_to_end(key)
            while len(self._answers) > KEPT:
                self._answers.popitem(last=False)
        columns = [known.slopes[name] for name in names]
        empty = np.zeros((*known.outputs.shape, 0))
        return known.outputs, np.stack(columns, axis=-1) if columns else empty
