"""Stiffness and damping from tests under their public name; their modules stand in `vpm.studies.impedance`."""

from vpm.studies.impedance import *  # noqa: F403
from vpm.studies.impedance import __all__  # noqa: F401
