"""Tried effect: its fit beside a structure, and its judgement."""

from __future__ import annotations

from dataclasses import dataclass, replace

from vpm.catalogue import EFFECTS
from vpm.discrepancy.screening.candidates import Key
from vpm.model import Model
from vpm.numbers import rough_percent
from vpm.ranking.fit import Fitted
from vpm.ranking.judgement import Judgement
from vpm.ranking.look import Look


@dataclass(frozen=True, eq=False)
class Trial:
    """Trial of an effect beside a structure, under one tracker."""

    key: Key
    fitted: Fitted
    look: Look
    judgement: Judgement
    evidence: float = float("nan")
    rivals: tuple[str, ...] = ()

    @classmethod
    def of(cls, fitted: Fitted, look: Look, key: Key | None = None, *, ended: bool = True) -> Trial:
        """Trial from the fit of a structure, of its last effect by default; the fit has ``ended`` or only begun."""
        key = key or fitted.structure.effects[-1]
        return cls(key, fitted, look, look.judged(fitted, key, ended=ended))

    @property
    def counts(self) -> bool:
        """Whether a tried effect counts: beyond chance and beyond errors of laws."""
        return self.fitted.structure.shows(self.key) and self.judgement.counts(self.look.settings)

    @property
    def beside_mirror_image(self) -> Trial:
        """Trial judged by what it explains of the error, and not of its mirror image."""
        return replace(self, judgement=self.look.explained_by(self.fitted, self.judgement))

    @property
    def moves_apart(self) -> bool:
        """Whether a tried effect splits a joint, or gives what is split a play."""
        now, before = (one.structure.model.added_joints for one in (self.fitted, self.look.fitted))
        return len(now) > len(before) or EFFECTS[self.key[0]].has_play

    @property
    def left(self) -> float:
        """Share of the error power that a tried effect leaves."""
        return 1.0 - self.judgement.removed

    @property
    def label(self) -> str:
        """Label of a tried effect: ``effect at site``."""
        return " at ".join(self.key)

    @property
    def removing(self) -> str:
        """Text on what a tried effect does: ``removes 3 % of the error power``."""
        if self.judgement.removed <= self.look.settings.worth:
            return "does what values far from the model file did"
        return f"removes {rough_percent(self.judgement.removed)} of the error power"

    @property
    def is_instrument(self) -> bool:
        """Whether a tried effect is an error of a sensor, not of the machine."""
        return EFFECTS[self.key[0]].site == "sensor"

    def contains(self, other: Trial) -> bool:
        """Whether a tried effect contains another one at some values of its parameters."""
        return is_part(self.look.fitted.structure.model, other.key, self.key)

    @property
    def order(self) -> tuple[bool, int, int]:
        """Order of tried effects that records do not discriminate: machine before sensors, then the simplest.

        The catalogue lists commoner effects first.
        """
        return self.is_instrument, self.numbers, list(EFFECTS).index(self.key[0])

    @property
    def numbers(self) -> int:
        """Number of unknown parameters of a tried effect."""
        return len(self.fitted.structure.priors)


def is_part(model: Model, plainer: Key, richer: Key) -> bool:
    """Whether an effect is contained in a richer one that was tried at its joint or that of its body."""
    (name, site), (other, place) = plainer, richer
    return name in EFFECTS[other].contains and (site == place or model.joint_of_body(place) == site)
