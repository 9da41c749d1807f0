"""Compiled systems, one for all models that differ in parameter values only.

A core is given the values at every call; what it records and compiles of the equations then serves every model of the
same structure.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vpm.errors import VpmError
from vpm.model.compile import described

if TYPE_CHECKING:
    from vpm._core import System
    from vpm.model.model import Model

#: Systems that are kept; each holds what it recorded and compiled.
KEPT = 64

_systems: OrderedDict[str, System] = OrderedDict()
_lock = Lock()


def core_of(structure: str, theta: NDArray[np.float64]) -> System:
    """Compiled system of a structure, as `structure_text` gives it, for the parameters ``theta``.

    Raises
    ------
    CoreError
        The core refuses the description.
    VpmError
        There is no core.
    """
    try:
        from vpm._core import System
    except ImportError as error:
        raise VpmError(f"the compiled core of vpm cannot be imported ({error}); reinstall vpm-dynamics") from error
    with _lock:
        known = _systems.get(structure)
        if known is not None:
            _systems.move_to_end(structure)
    if known is not None:
        known.check(theta)
        return known
    system = System(described(structure, theta))
    with _lock:
        _systems[structure] = system
        while len(_systems) > KEPT:
            _systems.popitem(last=False)
    return system


@dataclass(frozen=True)
class Shape:
    """A model of which the structure counts alone: the key of answers that hold whatever the values are.

    Attributes
    ----------
    model : Model
        One of those that differ in values only.
    structure : str
    """

    model: Model = field(compare=False)
    structure: str = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "structure", self.model.structure)
