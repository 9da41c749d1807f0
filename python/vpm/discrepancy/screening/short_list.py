"""Short list of a round: candidates to be refitted, and candidates that are one model under two names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from vpm.discrepancy.screening.candidates import Key, joint_at
from vpm.discrepancy.screening.probe import Probe

#: Candidates refitted in one round: those that have the largest predicted gain for their numbers, of the machine and of
#: each joint, and those that have the largest predicted gain of all. Without the last, several names of one regressor,
#: as a constant force and a tilted world, crowd out a law of two numbers that takes more than any of them.
SHORT_LIST, OF_JOINT, RICHEST = 7, 3, 2
#: Share by which the gain that screening predicts of two candidates may differ by rounding alone.
TWIN = 1e-6


def same_models(short_list: Sequence[Probe]) -> dict[Key, Key]:
    """Candidates for the short list with a motion of their own that are the same model as an earlier one.

    A rigid link that bends at its root is a drive with joint compliance: no digit of what screening says parts the two.
    Refits of such machines take long, so that one of each pair has to be enough where it is refused.
    """
    found: dict[Key, Key] = {}
    for place, one in enumerate(short_list):
        for other in short_list[:place]:
            pair = one.candidate.effect, other.candidate.effect
            heavy = all(effect.elastic for effect in pair) and pair[0].motion != pair[1].motion
            same = len(one.free) == len(other.free) and abs(one.drop - other.drop) <= TWIN * abs(other.drop)
            if heavy and same and other.candidate.key not in found:
                found[one.candidate.key] = other.candidate.key
    return found


def most_promising(promising: Sequence[Probe]) -> list[Probe]:
    """Short list of probes to refit, by falling score.

    Efforts of each joint are balanced by themselves, so that what one joint lacks says nothing of another one.
    """
    richest = {p.candidate.key for p in sorted(promising, key=lambda p: -p.drop)[:RICHEST]}
    seats: Counter[str] = Counter()
    chosen = []
    for rank, one in enumerate(promising):
        joint = joint_at(one.model, one.candidate.site)
        if rank < SHORT_LIST or one.candidate.key in richest or (joint and seats[joint] < OF_JOINT):
            chosen.append(one)
            seats[joint] += 1
    return chosen
