"""Closed linkages under their public name; their modules stand in `vpm.studies.linkages`."""

from vpm.studies.linkages import *  # noqa: F403
from vpm.studies.linkages import __all__  # noqa: F401
