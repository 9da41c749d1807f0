"""The library of finite elements, where it is installed."""

from __future__ import annotations

from types import ModuleType

from vpm.errors import MissingExtraError


def finite_elements() -> ModuleType:
    """scikit-fem.

    Raises
    ------
    MissingExtraError
        It is not installed.
    """
    try:
        import skfem
    except ImportError as error:
        raise MissingExtraError("scikit-fem", "fem") from error
    module: ModuleType = skfem
    return module
