"""Residual by joint: joints at which effects explain it, and open joints at which they do not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vpm.discrepancy.confirmation.confirmation import Data, judged_anyhow
from vpm.discrepancy.confirmation.refusal import NEGLIGIBLE
from vpm.discrepancy.diagnosis import ChannelGap, RefusedEffect
from vpm.discrepancy.noise.residual_structure import Structure
from vpm.discrepancy.screening.candidates import joint_at
from vpm.discrepancy.search.backward_elimination import Stage
from vpm.discrepancy.search.candidate_choice import Accepted
from vpm.discrepancy.search.search import Search
from vpm.errors import VpmError
from vpm.model import Model

#: A residual within this factor of the noise floor has nothing left to explain, unless it repeats.
FLOOR_FACTOR = 1.3
#: Smallest signal that divides: of a motor that is off there is none.
TINY = 1e-300
#: Where so much of what could be explained remains, what was found is not the explanation.
MOSTLY_OPEN = 0.15


@dataclass(frozen=True)
class Joints:
    """Joints with a clear residual: open ones, and closed ones that effects explain."""

    open: Mapping[str, float]  #: Joints at which most of the gap is left, and the share of its mean square that is.
    closed: tuple[str, ...]  #: Joints at which they explain it.
    worst: str  #: The joint with the largest gap beside its effort, "" without any.

    @classmethod
    def of(cls, gap: Mapping[str, ChannelGap], left: Structure | None, tracked: Mapping[str, float]) -> Joints:
        """Open and closed joints, from the residual by joint and what a tracker leaves, see `Search.left`."""
        efforts = {channel.rpartition(".")[0]: g for channel, g in gap.items() if _is_effort(channel, g)}
        efforts = {joint: g for joint, g in efforts.items() if _is_clear(g.recalibrated, g)}
        shares = {
            joint: min((g.after / g.recalibrated) ** 2, tracked.get(joint, np.inf)) for joint, g in efforts.items()
        }
        most = {joint: share for joint, share in shares.items() if share > MOSTLY_OPEN}
        still = {
            joint: share
            for joint, share in most.items()
            if left is not None and left.present and _is_clear(efforts[joint].after, efforts[joint])
        }
        worst = max(
            efforts, key=lambda joint: efforts[joint].recalibrated / max(efforts[joint].signal, TINY), default=""
        )
        return cls(still, tuple(joint for joint in shares if joint not in most), worst)

    @property
    def differ(self) -> bool:
        """Whether there are both open and closed joints."""
        return bool(self.open and self.closed)

    def has(self, entry: Accepted, model: Model) -> bool:
        """Whether an effect acts at an open joint; one that acts on all joints counts at the worst."""
        return (joint_at(model, entry.key[1]) or self.worst) in self.open


def _is_effort(channel: str, gap: ChannelGap) -> bool:
    return channel.endswith(".effort") and gap.mode == "inverse_dynamics"


def _is_clear(value: float, gap: ChannelGap) -> bool:
    """Whether the residual of a joint is clear of noise and not negligible beside the effort."""
    return value > FLOOR_FACTOR * gap.noise_floor and value > NEGLIGIBLE * gap.signal


def only_where_closed(found: Search, data: Data, gap: Mapping[str, ChannelGap], left: Structure) -> Search:
    """Search without effects at joints whose residual stays open, if other joints are closed.

    What happens at one joint says nothing of effects at another one. All is fitted again without them.
    """
    joints, model = Joints.of(gap, left, found.left), found.final.model
    gone = [entry for entry in found.accepted if joints.has(entry, model)]
    if not joints.differ or not 0 < len(gone) < len(found.accepted):
        return found
    try:
        for entry in reversed(gone):
            model = model.without_effect(*entry.key, entry.side)
        free, bounds = found.final.kept_in(model)
        judged, _ = judged_anyhow(model, free, data, bounds)
    except VpmError:
        return found  # another one rests on it
    return replace(
        found,
        stages=(*found.stages, *(Stage("removed", *entry.key, judged) for entry in gone)),
        accepted=tuple(entry for entry in found.accepted if entry not in gone),
        refused=(*(_refused(entry, joints, found.final.model) for entry in gone), *found.refused),
    )


def _refused(entry: Accepted, joints: Joints, model: Model) -> RefusedEffect:
    joint = joint_at(model, entry.key[1]) or joints.worst
    share = 100.0 * joints.open[joint]
    return RefusedEffect(*entry.key, f"{share:.0f} % of the mean square of the gap at {joint} is left with it")
