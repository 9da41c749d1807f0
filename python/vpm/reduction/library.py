"""The library of finite elements and its reader of meshes, where they are installed."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from vpm.errors import needs


def finite_elements(module: str = "skfem") -> ModuleType:
    """Library for finite elements: scikit-fem, a module of it, or meshio.

    Raises
    ------
    MissingExtraError
        It is not installed.
    """
    with needs("meshio" if module == "meshio" else "scikit-fem", "fem"):
        return import_module(module)
