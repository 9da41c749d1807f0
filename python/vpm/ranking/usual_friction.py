"""Usual friction at all joints at once, of a model that leaves its records without it."""

from __future__ import annotations

from collections.abc import Sequence

from vpm.catalogue import EFFECTS
from vpm.discrepancy.screening.candidates import candidates
from vpm.identify import InverseDynamicsProblem
from vpm.ranking.look import Look
from vpm.ranking.model_structure import Structure
from vpm.ranking.parameter_priors import Sizes
from vpm.ranking.regression import regressed
from vpm.ranking.start_values import started
from vpm.ranking.structure_extensions import Extensions


def with_usual_friction(
    look: Look, data: InverseDynamicsProblem, extensions: Extensions, sizes: Sizes, names: Sequence[str], most: int
) -> Structure | None:
    """Structure with the usual friction that its joints lack, by regression; None where that is more than ``most``.

    Friction of gears may take many times the torque of the inertia. Where several joints lack it, each of them hides
    what friction at another one would explain.
    """
    structure, usual = look.fitted.structure, [name for name in names if EFFECTS[name].usual == "friction"]
    model = structure.repaired
    residual, _ = data.evaluate(model, model.theta)
    listed = [started(one, model, sizes) for one in candidates(model, data, residual, usual, either_side=True)]
    if not 1 < len(listed) <= most:
        return None
    for candidate in listed:
        structure = extensions.extended(structure, candidate, candidate.starts[0], "motor")
    return regressed(structure, data)
