"""Diagnosis, the result: verdict, accepted and refused effects, and everything needed to doubt them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vpm.catalogue.kinds import Side, in_words
from vpm.discrepancy.evidence import Evidence
from vpm.discrepancy.provenance import Provenance
from vpm.files import write_text
from vpm.identify import Fit
from vpm.json_values import plain
from vpm.model import Model
from vpm.numbers import Array
from vpm.results import Result, Storable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vpm.excitation import Excitation


#: Mode of a gap that a tracker leaves, as results and reports write it.
OBSERVED = "observed"


@dataclass(frozen=True, repr=False, eq=False)
class EffectParameterEstimate(Storable):
    """Estimate of one parameter of an accepted effect: names, SI value, unit and standard deviation."""

    name: str
    dotted: str
    value: float
    unit: str
    std: float


@dataclass(frozen=True, repr=False, eq=False)
class AcceptedEffect(Storable):
    """Accepted effect in a diagnosis: what it says of the machine, with estimates and evidence.

    Attributes
    ----------
    name, site : str
    sentence : str
        For people.
    parameters : tuple of EffectParameterEstimate
        In the final model, after all effects were fitted together.
    gain : float
        Share of the validation residual's mean square that went when it was accepted; NaN where Ctrl-C came before.
    score : float
        That gain in standard deviations between independent blocks.
    notes : tuple of str
        What was held, and what the data do not discriminate from it.
    probability : float
        That this is what was missing beside the effects before it; NaN where no ranking named it.
    evidence_nats : float
        What it added to the evidence of the records; NaN where no ranking named it.
    class_probability : float
        That it was this or one of those that the records do not tell from it; NaN where no ranking named it.
    side : str
        Of a joint that gives way: ``"motor"`` or ``"link"``.
    """

    name: str
    site: str
    sentence: str
    parameters: tuple[EffectParameterEstimate, ...]
    gain: float
    score: float
    notes: tuple[str, ...]
    probability: float = float("nan")
    evidence_nats: float = float("nan")
    class_probability: float = float("nan")
    side: Side = "motor"

    @property
    def label(self) -> str:
        """Label of an accepted effect: ``effect at site``, with its side if that is not the motor's."""
        return f"{self.name} at {in_words(self.site, self.side)}"

    def to_dict(self) -> dict[str, object]:
        """Plain numbers and text of an accepted effect, its parameters by name."""
        parameters = {
            p.name: {"value": plain(p.value), "unit": p.unit, "std": plain(p.std), "path": p.dotted}
            for p in self.parameters
        }
        return {**super().to_dict(), "parameters": parameters}


@dataclass(frozen=True, repr=False, eq=False)
class RefusedEffect(Storable):
    """Refused effect in a diagnosis: a candidate that was tried and not accepted, with the reason."""

    name: str
    site: str
    reason: str


@dataclass(frozen=True, repr=False, eq=False)
class RankedCandidate(Storable):
    """Ranked candidate in a diagnosis, in the order of what it removes.

    Attributes
    ----------
    name, site : str
    round : int
        Round of the ranking, from 1.
    screened : float
        Share of the error power that its fit removes under the tracker.
    unseen : float
        Share of the validation mean square that it took away after refitting; NaN if it was not refitted.
    accepted : bool
    evidence_nats, probability : float
        What it added to the evidence, and that it is what is missing; NaN where it did not count.
    """

    name: str
    site: str
    round: int
    screened: float
    unseen: float
    accepted: bool
    evidence_nats: float = float("nan")
    probability: float = float("nan")


@dataclass(frozen=True, repr=False, eq=False)
class Ambiguity(Storable):
    """Ambiguity in a diagnosis: effects that these data do not discriminate from an accepted one, and why."""

    name: str
    site: str
    others: tuple[str, ...]
    reason: str

    def to_dict(self) -> dict[str, object]:
        """Plain text of an ambiguity."""
        return {"name": self.name, "site": self.site, "with": list(self.others), "reason": self.reason}


@dataclass(frozen=True, repr=False, eq=False)
class EmpiricalTerm(Storable):
    """Term of an empirical force in a diagnosis: joint, text, dotted parameter, coefficient, deviation and unit."""

    joint: str
    term: str
    dotted: str
    coefficient: float
    std: float
    unit: str


@dataclass(frozen=True, repr=False, eq=False)
class Empirical(Storable):
    """Empirical description in a diagnosis: states on which an unexplained residual depends, and a fitted formula.

    Attributes
    ----------
    channel : str
        The effort whose residual was examined.
    states : dict of str to float
        Share of its mean square on validation data that each state predicts, the largest first.
    remark : str
        What runs with the time and not with the machine, in words, or "".
    formula : str
        With numbers and units, or "".
    terms : tuple of EmpiricalTerm
    before, after : float
        Root mean square of the weighted residual on validation data without and with the formula.
    sentence : str
    alike : tuple of str
        States whose share these data do not discriminate from the largest, the largest itself among them; none if they
        cannot tell the largest from zero.
    predicted : float
        Share of the mean square on validation data that the formula, or what the remark says, predicts.
    """

    channel: str
    states: dict[str, float]
    remark: str
    formula: str
    terms: tuple[EmpiricalTerm, ...]
    before: float
    after: float
    sentence: str
    alike: tuple[str, ...] = ()
    predicted: float = 0.0


@dataclass(frozen=True, repr=False, eq=False)
class ChannelGap(Storable):
    """Root mean square error of one channel on validation data at each stage of a diagnosis.

    Attributes
    ----------
    before, recalibrated, after : float
        Nominal model, nominal effects with refitted parameters, and with the accepted effects, in ``unit``.
    noise_floor : float
        What sensor noise alone leaves; NaN where it was not estimated.
    unit : str
    signal : float
        Root mean square of the measured signal; the gaps over it are the relative errors.
    mode : str
        Mode of comparison; `OBSERVED` where a tracker kept the model on the record.
    """

    before: float
    recalibrated: float
    after: float
    noise_floor: float
    unit: str
    signal: float
    mode: str

    def share(self, value: float) -> float:
        """Share of an error in the measured signal of a diagnosed channel; NaN without one."""
        return value / self.signal if self.signal > 0.0 else float("nan")

    def to_dict(self) -> dict[str, object]:
        """Plain numbers and text of a channel error, with its shares in the signal."""
        stages = ("before", "recalibrated", "after")
        return {**super().to_dict(), **{f"{name}_relative": plain(self.share(getattr(self, name))) for name in stages}}


@dataclass(frozen=True, repr=False, eq=False)
class ProposedExperiment(Storable):
    """Experiment that a diagnosis proposes to discriminate two effects.

    Attributes
    ----------
    effect, rival : str
        ``effect at site``.
    excitation : Excitation
        The motion to make; ``excitation.to_csv`` writes it for the machine.
    parameters : dict of str to float or str
        Of the signal, in SI units.
    channel, unit : str
        Where the difference shows.
    difference : float
        Root mean square that the rival could not imitate by other values of its parameters.
    noise : float
        Of the same channel.
    sentence : str
    """

    effect: str
    rival: str
    excitation: Excitation
    parameters: dict[str, float | str]
    channel: str
    unit: str
    difference: float
    noise: float
    sentence: str

    @property
    def ratio(self) -> float:
        """Predicted difference of a proposed experiment in units of the noise."""
        return self.difference / self.noise if self.noise > 0.0 else float("inf")

    def to_dict(self) -> dict[str, object]:
        """Plain numbers and text of a proposed experiment, without its samples."""
        content = {name: value for name, value in super().to_dict().items() if name != "excitation"}
        return {**content, "signal": self.excitation.name, "ratio": self.ratio}


@dataclass(frozen=True, repr=False, eq=False)
class Step(Storable):
    """Step of a diagnosis: the model after one stage of the findings.

    Attributes
    ----------
    change : {"recalibrated", "added", "removed"}
    effect, site : str
        What was added or removed.
    values, std, units : dict
        All fitted parameters by dotted name; deviations as if what was held were known.
    training_error, unseen_error : float
        Largest gap of any channel relative to what was measured.
    """

    change: str
    effect: str
    site: str
    values: dict[str, float]
    std: dict[str, float]
    units: dict[str, str]
    training_error: float
    unseen_error: float


@dataclass(frozen=True, repr=False, eq=False)
class Picture(Storable):
    """Samples for the plots of a diagnosis: one joint of the first validation record.

    Attributes
    ----------
    channel, unit : str
    coordinate_unit : str
        m or rad.
    time, position, velocity, measured : ndarray, shape (n,)
    before, recalibrated, after : ndarray, shape (n,)
        Residual at each stage; NaN where a sample does not count, as at standstill.
    """

    channel: str
    unit: str
    coordinate_unit: str
    time: Array
    position: Array
    velocity: Array
    measured: Array
    before: Array
    recalibrated: Array
    after: Array


@dataclass(frozen=True, repr=False, eq=False)
class Trace(Storable):
    """Trace in a diagnosis: one channel of the first validation record, measured and simulated.

    Attributes
    ----------
    record, channel, unit, mode : str
        And the mode of the simulation.
    time, measured : ndarray, shape (n,)
    before, after : ndarray, shape (n,)
        Simulated by the nominal model and by the one with the accepted effects; NaN where the first state settles.
    """

    record: str
    channel: str
    unit: str
    mode: str
    time: Array
    measured: Array
    before: Array
    after: Array


@dataclass(frozen=True, repr=False, eq=False)
class Diagnosis(Result):
    """Diagnosis of a model: the effects that it is missing, as far as the data can say.

    Attributes
    ----------
    verdict : {"effect_found", "parameters_only", "no_disagreement", "unexplained", "interrupted"}
    summary : str
        The verdict in a sentence or two.
    effects : tuple of AcceptedEffect
        By what each adds to the prediction of validation data beside all others, the most first. Effects that a ranking
        named stand in the order in which it found them.
    gap : dict of str to ChannelGap
        On validation data.
    refused : tuple of RefusedEffect
    candidates : tuple of RankedCandidate
    ambiguous_with : tuple of Ambiguity
    where : dict of str to tuple of str
        Residual by state region before any effect was added, by channel.
    steps : tuple of Step
        The recalibrated model and the model after each effect that came in or went out again.
    training, unseen : tuple of str
        Records.
    notes : tuple of str
        Choices made on the way: filters, splits, parameters that moved far.
    model : Model
        The repaired model.
    fit : Fit
        Its last fit.
    pictures : tuple of Picture
    seconds : float
        Time it took.
    interrupted : bool
        Ctrl-C ended the ranking: the effects are those accepted until then, and there may be more.
    evidence : tuple of Evidence
        For each accepted effect the residual over the state that it depends on, without it and with it.
    empirical : Empirical or None
        What is said of a residual that no effect explains.
    experiments : tuple of ProposedExperiment
        For each pair of effects that the data do not discriminate, the discriminating experiment.
    classes : tuple of tuple of str
        Each accepted effect that has rivals, with these, as ``effect at site``: the records do not discriminate them.
    traces : tuple of Trace
        What was measured and what is simulated; none where no validation record could be simulated.
    stated : dict of str to float
        Values of all parameters as the model file states them, SI.
    provenance : Provenance or None
        Files, settings and command that it came from.
    """

    verdict: str
    summary: str
    effects: tuple[AcceptedEffect, ...]
    gap: dict[str, ChannelGap]
    refused: tuple[RefusedEffect, ...]
    candidates: tuple[RankedCandidate, ...]
    ambiguous_with: tuple[Ambiguity, ...]
    where: dict[str, tuple[str, ...]]
    steps: tuple[Step, ...]
    training: tuple[str, ...]
    unseen: tuple[str, ...]
    notes: tuple[str, ...]
    model: Model
    fit: Fit
    pictures: tuple[Picture, ...]
    seconds: float
    interrupted: bool = False
    evidence: tuple[Evidence, ...] = ()
    empirical: Empirical | None = None
    experiments: tuple[ProposedExperiment, ...] = ()
    classes: tuple[tuple[str, ...], ...] = ()
    traces: tuple[Trace, ...] = ()
    stated: dict[str, float] = field(default_factory=dict)
    provenance: Provenance | None = None

    @property
    def order(self) -> str:
        """Sentence on the order in which a diagnosis lists its effects."""
        if any(not np.isnan(effect.evidence_nats) for effect in self.effects):
            return "in the order in which the ranking found them"
        return "by what each adds beside all the others, the most first"

    def to_dict(self) -> dict[str, object]:
        """Content of a diagnosis for ``report.json``: plain numbers and text, SI; unknown values are null."""
        apart = {"model", "fit", "pictures", "evidence", "traces", "stated"}
        content = {name: plain(value) for name, value in self.to_stored().items() if name not in apart}
        return {**content, "model": self.model.name}

    def save_json(self, path: Path) -> Path:
        """Write a diagnosis to ``report.json``."""
        return write_text(path, json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n")

    def _headline(self) -> Mapping[str, object]:
        names = ", ".join(e.label for e in self.effects) or "no effect"
        return {"verdict": self.verdict, "effects": names, "seconds": self.seconds}

    def _frame_columns(self) -> Mapping[str, object]:
        fields = ("name", "site", "round", "screened", "unseen", "accepted")
        return {name: [getattr(c, name) for c in self.candidates] for name in fields}

    def plot(self) -> Figure:
        """Plot a diagnosis: residual before and after, over time, velocity and position. Needs the extra ``plot``.

        Where no efforts follow from a motion: what was measured, and what an observer makes of the model.
        """
        from vpm.plot import plot_pictures
        from vpm.plot.findings import plot_traces

        return plot_pictures(self.pictures) if self.pictures or not self.traces else plot_traces(self.traces)
