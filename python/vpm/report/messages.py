"""What the page and the terminal say alike: how sure a value is, what an effect took, where the steps stand."""

from collections.abc import Sequence
from math import isfinite, isnan

from vpm.discrepancy import AcceptedEffect, Diagnosis, Step
from vpm.discrepancy.settings import NORMAL_95_ONE_SIDED
from vpm.numbers import percent, short

VERDICT_WORDS = {
    "effect_found": "An effect is missing in the model, and the data name it.",
    "parameters_only": "Nothing is missing: the known parameters only had other values.",
    "no_disagreement": "Model and data agree.",
    "unexplained": "Something is missing, and no effect of the catalogue explains it.",
    "interrupted": "Stopped before there was an answer.",
}


def estimate(
    value: float, std: float, unit: str, stated: float | None = None, unseen: str = "the records do not show it"
) -> str:
    """Message on an estimate, ``0.55 ± 0.01 N m``, and whether it differs from zero and the model file.

    Parameters
    ----------
    value, std : float
        A deviation of zero stands for a value that was held.
    stated : float, optional
        Value of the model file; None for what the file does not have.
    unseen : str
        Why a deviation is infinite.
    """
    shown = f" {unit}" if unit != "1" else ""
    if not std > 0.0:
        return f"{short(value)}{shown} (held)" if std == 0.0 else f"{short(value)}{shown} (deviation unknown)"
    spread = f" ± {std:.2g}" if isfinite(std) else ""
    return f"{short(value)}{spread}{shown}{_undetermined(value, std, stated, unseen)}"


def _undetermined(value: float, std: float, stated: float | None, unseen: str) -> str:
    """Message ``, undetermined: ...`` for a value within its deviation of zero or the file's, or ""."""
    if not std > 0.0:
        return ""
    if not isfinite(std):
        return f", undetermined: {unseen}"
    if abs(value) <= std:
        return ", undetermined: within its deviation of zero"
    if stated is not None and abs(value - stated) <= std:
        return f", change undetermined: within its deviation of the model file's {short(stated)}"
    return ""


def took(effect: AcceptedEffect, later: Sequence[AcceptedEffect] = ()) -> str:
    """Message on what an effect did to the validation error when it came in, while ``later`` ones were missing."""
    if isnan(effect.gain):
        return "was not measured on validation records"
    did = "took" if effect.gain >= 0.0 else "added"
    ending = "of the validation mean square" if effect.gain >= 0.0 else "to the validation mean square"
    beside = f" while {' and '.join(one.label for one in later)} {'was' if len(later) == 1 else 'were'} missing"
    chance = f", no more than chance{beside if later else ''}" if effect.score < NORMAL_95_ONE_SIDED else ""
    return f"{did} {percent(abs(effect.gain))} {ending} ({effect.score:.1f} standard deviations{chance})"


def probability(effect: AcceptedEffect) -> str:
    """Message on evidence and probability by a ranking, or ""."""
    if isnan(effect.evidence_nats):
        return ""
    own, whole = effect.probability, effect.class_probability
    beside = f", {whole:.2f} with what is not discriminated from it" if whole > own else ""
    return f"evidence {short(effect.evidence_nats)} nats, probability {own:.2f}{beside}"


def last_stage(d: Diagnosis) -> str:
    """Message on what the last model has that the recalibrated one has not, or ""."""
    formula = d.empirical is not None and bool(d.empirical.formula)
    if d.effects:
        return "with the effects and a formula" if formula else "with the effects"
    return "with a formula, which is no physics" if formula else ""


def step_name(step: Step) -> str:
    """Message for a step of a diagnosis, such as ``+ coulomb_friction at axis``."""
    signs = {"recalibrated": "recalibrated parameters", "added": "+ ", "removed": "− "}
    return signs[step.change] + (f"{step.effect} at {step.site}" if step.effect else "")


def refitted(d: Diagnosis) -> list[tuple[str, str, str]]:
    """Messages on parameters of the model file that the last fit moved: name, stated value, estimate."""
    rows = []
    for name, value, std, unit in zip(d.fit.names, d.fit.values, d.fit.std, d.fit.units, strict=True):
        if name in d.stated:
            said = estimate(float(value), float(std), unit, d.stated[name], _unseen(d, name))
            rows.append((name, f"{short(d.stated[name])} {unit if unit != '1' else ''}".strip(), said))
    return rows


def _unseen(d: Diagnosis, name: str) -> str:
    """Message on why the last fit of a diagnosis has no deviation of a parameter."""
    shown = "efforts" if d.fit.mode == "inverse_dynamics" else "records"
    together = [one.names for one in d.fit.unidentifiable if name in one.names]
    others = list(dict.fromkeys(other for names in together for other in names if other != name))
    return f"the {shown} show it only together with {', '.join(others)}" if others else f"the {shown} do not show it"
