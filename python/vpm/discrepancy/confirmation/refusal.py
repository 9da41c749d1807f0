"""Refusal of a candidate: the reason in words with numbers."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scipy.special import stdtrit

from vpm.discrepancy.confirmation.confirmation import Trial
from vpm.discrepancy.screening.compliance_and_stop_start import coupled
from vpm.discrepancy.screening.probe import Probe, impossible_values
from vpm.discrepancy.settings import (
    CLEAR_GAIN,
    FALSE_ALARM_LEVEL,
    LEAST_GAIN,
    MODEST_FACTOR,
    MODEST_GAIN,
    NEGLIGIBLE,
    NORMAL_95_ONE_SIDED,
    SAMPLED,
    SLIGHT,
    WORTH_A_NAME,
)
from vpm.identify import Gain
from vpm.model import Model
from vpm.numbers import NORMAL_95, percent, short


@dataclass(frozen=True)
class Thresholds:
    """Thresholds below which an effect is refused."""

    #: Number of candidates tried in the whole diagnosis; the false-alarm level is divided by it (Bonferroni).
    candidates: int
    #: Sampling interval of the coarsest record, s; delays and lags below it that explain little are part of sampling.
    interval: float

    def score(self, pieces: int) -> float:
        """Threshold of the validation gain, in standard deviations by Student's t for so few pieces."""
        return float(stdtrit(max(1, pieces - 1), 1.0 - FALSE_ALARM_LEVEL / max(1, self.candidates)))

    def needed(self, validation: Gain) -> float:
        """Standard deviations of gain below which an effect is refused; more where most of the residual stays."""
        modest = validation.relative < MODEST_GAIN
        return self.score(validation.pieces) * (MODEST_FACTOR if modest else 1.0)

    def met(self, validation: Gain) -> bool:
        """Whether a gain meets the thresholds: it is large enough and sure."""
        return validation.relative >= WORTH_A_NAME and validation.score >= self.needed(validation)


def refuse_probe(probe: Probe) -> str:
    """Reason of refusal after screening, or ""."""
    if not probe.free:
        if probe.held:
            partners = ", ".join(dict.fromkeys(alias.partner for alias in probe.held))
            return f"these data do not discriminate it from {partners}"
        return "it has no influence on these data"
    if probe.drop < 0.0:
        return "it would make the training error larger wherever it was tried"
    if probe.drop < NEGLIGIBLE and probe.here < WORTH_A_NAME:
        return f"it would lower the training error by only {percent(probe.drop)} of its mean square"
    outside = impossible_values(probe)
    if outside:
        return _impossible(probe, outside[0])
    return ""


def refuse_trial(trial: Trial, thresholds: Thresholds) -> str:
    """Reason of refusal of a refitted candidate, or ""."""
    reasons = (
        _too_short(trial, thresholds.interval),
        _no_place(trial),
        _no_way(trial),
        _slight(trial),
        _only_training(trial),
        _not_clear(trial),
        worse_in_simulation(trial),
        _too_little(trial, thresholds),
    )
    return next(filter(None, reasons), "")


def refuse_ringing(share: float, trial: Trial) -> str:
    """Reason of refusal of a candidate that only lowers the ringing of links with measurement noise, or "".

    ``share`` of the mean square of noise alone goes with that, by simulation.
    """
    rest = trial.validation.relative - max(share, 0.0)
    if rest >= WORTH_A_NAME:
        return ""
    noise = "lower" if share >= 0.0 else "raise"
    return (
        f"it {_moves('the validation error', trial.validation)}; it would {noise} noise of the measured motion alone, "
        f"which rings in the links, by {percent(abs(share))} of its mean square"
    )


def explains_most(trial: Trial) -> bool:
    """Whether a delay explains so much that uncertain sample times are no reason of refusal.

    Where there are peers on its clock, a shift of all commands tells what is physics.
    """
    candidate = trial.probe.candidate
    late = bool(candidate.effect.late) and not has_peers(trial.judged.model, candidate.site)
    return late and trial.validation.relative >= CLEAR_GAIN


def refuse_timing(timed: Gain, shift: float, thresholds: Thresholds, *, beside: float) -> str:
    """Reason of refusal of a candidate that does no more than shifted commands within a sampling interval.

    - ``timed``: of the candidate, with a shift before and after
    - ``shift``: how much later commands hold without the candidate, in sampling intervals
    - ``beside``: the same with it. The shift and the candidate are one finding with two names if beside the candidate
      no shift matters, and beside the shift the candidate does. That is one question, and the data answer it if they
      are clear
    """
    encompasses = beside == 0.0 and timed.relative >= LEAST_GAIN
    if thresholds.met(timed) or (encompasses and timed.score >= replace(thresholds, candidates=1).score(timed.pieces)):
        return ""
    return (
        f"beside a shift of the commands by {1e3 * shift * thresholds.interval:.2g} ms, within the sampling interval, "
        f"it {_moves('the validation error', timed, 'only ')}"
    )


def _impossible(probe: Probe, name: str) -> str:
    parameter = probe.model.parameters[name]
    value = f"{probe.values[name]:.3g} ± {probe.std[name]:.2g} {parameter.unit}"
    sign = "negative" if probe.values[name] < 0.0 <= parameter.minimum else "outside its physical range"
    return f"its coefficient {name} comes out {sign} ({value}): {probe.candidate.effect.impossible}"


def _too_short(trial: Trial, interval: float) -> str:
    """Refusal of a delay or lag below one sampling interval: how commands are logged may explain it.

    The hold is that of all commands. One of several drives or instruments may have a delay and the others none.
    `refuse_timing` then judges it beside a shift of them all, if it explains more than an imitation would. The time of
    a lossy link is no delay: it is a share of its stiffness.
    """
    model = trial.judged.model
    site = trial.probe.candidate.effect.site
    peers = has_peers(model, trial.probe.candidate.site) and trial.validation.relative >= MODEST_GAIN
    if site in {"link", "body", "beam"} or peers or explains_most(trial):
        return ""
    for name in trial.parameters:
        parameter = model.parameters[name]
        if parameter.unit == "s" and parameter.value < interval:
            return (
                f"{name} comes out as {1e3 * parameter.value:.3g} ms, less than the sampling interval of "
                f"{1e3 * interval:.3g} ms, and {_moves('the validation error', trial.validation)}: "
                "so little is not discriminated from the sampling itself"
            )
    return ""


def has_peers(model: Model, site: str) -> bool:
    """Whether several drives, or several position sensors, share one clock, so that a delay of one is no refusal."""
    encoders = {model.sensor_of(f"{joint}.position") for joint in model.joints} - {None}
    return any(site in group and len(group) > 1 for group in (set(model.actuators), encoders))


def _no_place(trial: Trial) -> str:
    """Refusal of a payload whose place does not show, on a body of which nobody knows the mass.

    A heavier body is a payload on the ray through its centre of mass. What is beside the ray shows as mass times
    distance, and has to be more than an error of the model.
    """
    site, effect = trial.probe.candidate.site, trial.probe.candidate.effect
    mass = f"{site}.mass"
    shown = len(trial.parameters) > 1 or trial.error > NEGLIGIBLE
    if effect.site != "body" or mass not in trial.judged.free or shown:
        return ""
    return f"these data do not discriminate it from {mass}"


def _no_way(trial: Trial) -> str:
    """Refusal of a hysteresis that turns round within the way of one sample: it is dry friction.

    So is one within the way of two, unless its way is clearly longer than that of one. It may explain most of the
    remaining error beside fitted dry friction. Then the data discriminate the two: joints reverse slowly, over many
    samples.
    """
    candidate, bounds = trial.probe.candidate, trial.judged.bounds
    way = next((tried.parameter for tried in candidate.effect.tried if tried.sampled), None)
    if way is None:
        return ""
    name = trial.judged.model.effect(*candidate.key).parameter_names[way]
    parameter = trial.judged.model.parameters[name]
    least = bounds[name][0]
    fit = trial.judged.fit
    std = float(fit.std[fit.names.index(name)]) if name in fit.names else 0.0
    clear = parameter.value - NORMAL_95_ONE_SIDED * std > 1.001 * least
    beside_dry = f"{candidate.site}.friction.coulomb" in trial.judged.free and trial.validation.relative >= CLEAR_GAIN
    if clear or parameter.value > (1.001 if beside_dry else SAMPLED) * least:
        return ""
    return (
        f"{parameter_text(trial.judged.model, name, std)}, and the joint passes {least:.3g} "
        f"{parameter.unit} between two samples: what builds up within two of them is like dry friction"
    )


def _slight(trial: Trial) -> str:
    """Refusal of an effect that does less than the laws of the model are wrong by, unless its own law is exact."""
    if trial.size > SLIGHT or trial.probe.candidate.effect.exact or trial.validation.relative < 0.0:
        return ""
    return f"it does {percent(trial.size)} of what was measured of any channel, and no law is as exact as that"


def _only_training(trial: Trial) -> str:
    """Sentence on what raises the validation error, which gains too little there in any case."""
    seen, validation = trial.training, trial.validation
    if validation.relative >= 0.0:
        return ""
    joined = "and" if seen.relative < 0.0 else "but"
    return f"it {_moves('the training error', seen)}, {joined} {_moves('the validation error', validation)}"


def _not_clear(trial: Trial) -> str:
    if trial.clear:
        return ""
    model, fit = trial.judged.model, trial.judged.fit
    worst = trial.parameters[0]
    std = float(fit.std[fit.names.index(worst)])
    value = model.parameters[worst].value
    low, high = value - NORMAL_95 * std, value + NORMAL_95 * std
    return f"the 95 % interval of {worst} covers zero ({low:.3g} to {high:.3g} {model.parameters[worst].unit})"


def _too_little(trial: Trial, thresholds: Thresholds) -> str:
    validation = trial.there
    if validation.relative < WORTH_A_NAME:
        return f"it {_moves('the validation error', validation, 'only ')}"
    needed = thresholds.needed(validation)
    if validation.score < needed:
        return (
            f"its gain of {percent(validation.relative)} on validation data is {validation.score:.1f} standard "
            f"deviations over {validation.pieces} independent pieces, and {needed:.1f} are needed "
            f"when {thresholds.candidates} candidates are tried"
        )
    return ""


def worse_in_simulation(trial: Trial) -> str:
    """Reason of refusal by the simulation: the trial predicts it worse; or ""."""
    if trial.diverged:
        return f"with it the simulation of the validation record fails: {trial.diverged}"
    simulated = trial.simulated
    decided = coupled(trial.judged.model) and trial.validation.relative >= CLEAR_GAIN
    if simulated is None or decided or simulated.harm <= NORMAL_95_ONE_SIDED:
        return ""
    if simulated.relative < -LEAST_GAIN:
        joined = "and" if trial.validation.relative < 0.0 else "but"
        return (
            f"it {_moves('the validation error of the inverse-dynamics residual', trial.validation)}, {joined} "
            f"{_moves('that of the simulation', simulated)}, {simulated.harm:.1f} standard deviations"
        )
    return ""


def parameter_text(model: Model, name: str, std: float) -> str:
    """Parameter in the text of a refusal: ``name = value ± std unit``."""
    parameter = model.parameters[name]
    return f"{name} = {parameter.value:.5g} ± {std:.2g} {parameter.unit}"


def _moves(what: str, change: Gain, little: str = "") -> str:
    """Text of a refusal: ``lowers the validation error by 3.00 % of its mean square (0.2 to 0.197)``, or raises it."""
    numbers = f"of its mean square ({short(change.before)} to {short(change.after)})"
    if change.relative < 0.0:
        return f"raises {what} by {percent(-change.relative)} {numbers}"
    return f"lowers {what} by {little}{percent(change.relative)} {numbers}"
