"""Studies of D'Imperio's thesis: they use the tool, which works without them.

- `vpm.studies.linkages`: KARL and the leg of HyQ in closed form (chapter 2), public as `vpm.linkages`
- `vpm.studies.impedance`: stiffness and damping from loops and landings (chapter 5), public as `vpm.impedance`
- `vpm.studies.oil`: bulk modulus and gain of a valve (chapter 5), public as `vpm.identify_oil`
- `vpm.studies.maxwell`: the Maxwell element from windows of tests (section 5.2.5), public in `vpm.narx`
- `run_study`: a knee prosthesis, a fingertip and a carton (appendix B), by the finite elements of scikit-fem

Libraries and single studies are imported where they are used.
"""

from collections.abc import Callable

from vpm.errors import VpmError, near_match
from vpm.studies.study import Compared, Picture, Study, Table

__all__ = ["Compared", "Picture", "Study", "Table", "run_study"]


def run_study(name: str, mesh: int = 0) -> Study:
    """Run a study of solids.

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
    from vpm.studies.carton import fold_carton
    from vpm.studies.fingertip import fingertip
    from vpm.studies.knee import knee

    # Each with the mesh that it takes by itself.
    studies: dict[str, tuple[Callable[[int], Study], int]] = {
        "knee": (knee, 4),
        "fingertip": (fingertip, 3),
        "carton": (fold_carton, 4),
    }
    if name not in studies:
        raise VpmError(f'there is no study "{name}"; {near_match(name, studies, what="the studies are")}')
    if mesh < 0:
        raise VpmError(f"a mesh of fineness {mesh} cannot be made; give a number above 0")
    run, usual = studies[name]
    return run(mesh or usual)
