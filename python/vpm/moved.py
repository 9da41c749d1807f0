"""Names that modules of `vpm.studies` give now, where older scripts and files have them."""

import sys
from collections.abc import Callable
from importlib import import_module

#: How names of modules began in older files, and how they begin now.
_BEGINNINGS = {
    "vpm.identify.oil_": "vpm.studies.oil.",
    "vpm.impedance.": "vpm.studies.impedance.",
    "vpm.linkages.": "vpm.studies.linkages.",
    "vpm.narx.maxwell_": "vpm.studies.maxwell.",
}


def present_name(module: str) -> str:
    """Name of a module now, of one that an older file names."""
    former = next((each for each in _BEGINNINGS if module.startswith(each)), "")
    return _BEGINNINGS[former] + module.removeprefix(former) if former else module


def names_of_study(package: str, study: str) -> Callable[[str], object]:
    """Function `__getattr__` of a package that also has the public names of a study.

    The study is loaded at the first use of such a name, because it imports the package and not the other way round.
    """

    def load(name: str) -> object:
        # Names with underscores are asked for by Python itself, while the package is loaded.
        if not name.startswith("_") and name in import_module(study).__all__:
            return getattr(import_module(study), name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}", name=name, obj=sys.modules[package])

    return load
