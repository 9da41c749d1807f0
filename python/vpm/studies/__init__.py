"""Studies of D'Imperio's thesis beside robots: a knee prosthesis, a fingertip and a carton (appendix B).

They use the finite elements of scikit-fem (extra ``fem``), which are imported where they are used.
"""

from __future__ import annotations

from collections.abc import Callable

from vpm.errors import VpmError, near_match
from vpm.studies.carton import fold_carton
from vpm.studies.fingertip import fingertip
from vpm.studies.knee import knee
from vpm.studies.study import Compared, Picture, Study, Table

__all__ = ["STUDIES", "Compared", "Picture", "Study", "Table", "run_study"]

#: What runs each study, and the mesh that it takes by itself.
STUDIES: dict[str, tuple[Callable[[int], Study], int]] = {
    "knee": (knee, 4),
    "fingertip": (fingertip, 3),
    "carton": (fold_carton, 4),
}


def run_study(name: str, mesh: int = 0) -> Study:
    """Run a study.

    Parameters
    ----------
    name : str
        ``knee``, ``fingertip`` or ``carton``.
    mesh : int
        Fineness of the finest mesh; 0 for the one of the study.

    Raises
    ------
    VpmError
        There is no such study, its mesh cannot be made, or a load finds no balance.
    MissingExtraError
        scikit-fem is not installed.
    """
    if name not in STUDIES:
        raise VpmError(f'there is no study "{name}"; {near_match(name, STUDIES, what="the studies are")}')
    if mesh < 0:
        raise VpmError(f"a mesh of fineness {mesh} cannot be made; give a number above 0")
    run, usual = STUDIES[name]
    return run(mesh or usual)
