"""One concept, one word: pages, modules and public names use the terms of robotics and system identification."""

import re
from pathlib import Path

import pytest

from places import ROOT
from public_api import LIST
from vpm.catalogue import EFFECTS, EffectType

#: Phrases that no page uses, each with the field's term. Words that are ordinary English too stand in their phrases.
PHRASES = {
    r"balances? of efforts?|effort balances?": "inverse-dynamics residual, torque residual",
    r"own runs?|runs? of the model itself": "closed-loop prediction",
    r"restarts?|restarted simulations?": "multi-step prediction",
    r"unseen|never seen (data|records?)": "validation record, held-out",
    r"(model|effort|relative) gaps?|gaps? (of|on) (unseen|validation)( \w+)?|gaps? of the model": "model error",
    r"told apart|telling apart|tells? (the two|them|both) apart": "discriminate, discriminating experiment",
    r"overlooked (effects?|candidates?)": "forward step",
    r"finer laws?": "nested model",
    r"(effects?|rivals?) standing": "rival exchange",
    r"(late|slow) (drives?|instruments?|sensors?|effects?)|late (and|or) slow|slow (and|or) late": "delay, lag",
    r"plays?": "backlash",
    r"winds? up|wound up|winding up|wind-up": "joint compliance, deflection",
    r"believed|beyond belief|bounds of belief": "accepted, supported",
    r"promises?|promised": "predicted gain",
    r"(data|records?|runs?|logs?|residuals?) asks? for": "supported by",
    r"(residuals?|errors?) lives?": "residual by state region",
    r"counted samples|samples that count": "sample mask",
    r"glanc(e|es|ed|ing)( at)?": "coarse timing",
    r"climb(s|ed|ing)?": "model refinement",
    r"ladders?|rungs?": "Pareto front, candidate",
    r"walk(s|ed)? (back )?down|way (back )?down": "model reduction",
    r"velocity terms?": "Coriolis and centrifugal terms",
    r"lines with mass|(drives?|forces?) on lines": "two-point elements",
    r"drives? in sampled time": "discrete-time actuators",
    r"settled states?": "steady state",
    r"coloured noise|coloured residuals?": "noise spectrum",
    r"too dear": "too slow",
    r"no log says": "the log does not tell",
}

#: Files of pages in which a phrase stays, with the reason.
QUOTED = {
    ("docs/optimisation.md", "plays"): "a simulation plays an optimal motion",
    ("docs/view.md", "plays"): "the viewer plays a motion back",
}

#: Names that no module has, whole or between underscores.
MODULES = {
    *("apart", "believed", "climb", "coloured", "counted", "finer", "further", "gap", "gaps", "glance", "ladder"),
    *("late", "lines", "overheard", "overlooked", "place", "play", "promise", "remarks", "restart", "restarts"),
    *("rung", "seen", "settled", "slow", "standing", "telling", "ties", "told", "unseen", "winding", "words"),
    *("written",),
}

#: Modules that keep such a name, with the reason.
MODULES_THAT_STAY = {
    "python/vpm/climb": "the package of the public function `vpm.climb`, which needs a deprecation first",
    "python/vpm/climb_command.py": "the command `vpm climb`",
    "crates/vpm-core/src/model/place.rs": "places bodies in the order of the tree; no parameter of an effect",
}

#: Words that no public name has, whole or between underscores.
NAMES = MODULES | {"balance", "rungs"}

#: Public names that keep such a word, with the reason; the first group leaves by a deprecation.
NAMES_THAT_STAY = {
    **dict.fromkeys(("Climb", "climb"), "a command of the command line"),
    **dict.fromkeys(("Ladder", "ladder"), "a class of stored files, and the parameter of a report that takes it"),
    **dict.fromkeys(
        ("Diagnosis.unseen", "Fit.ties", "InertialFit.base_words", "Ladder.rungs"), "fields of stored files"
    ),
    **dict.fromkeys(("Report.ladder", "remarks", "ties"), "a parameter of public functions"),
    **dict.fromkeys(("ScenarioRun.told", "Observer.settled"), "a name of results that users call"),
    **dict.fromkeys(("Diagnosis.gap", "Ranking.gaps"), "the headline of a result"),
    "Model.lines": "a key of model files",
    "ImpulseBalance": "a balance of impulses, which is the field's term",
    "impulse_balance": "a balance of impulses, which is the field's term",
    "balance": "a balance of flows, which is the field's term",
    "Optimum.play": "plays a motion in a simulation",
    "gap": "time between two parts of a record",
}


def pages() -> list[Path]:
    top = (ROOT / f"{name}.md" for name in ("README", "ARCHITECTURE", "CONTRIBUTING"))
    return [*top, *sorted((ROOT / "docs").glob("*.md"))]


def prose(text: str) -> str:
    """A page without code and addresses, every line in its place."""
    text = re.sub(r"^```.*?^```", lambda block: "\n" * block[0].count("\n"), text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"`[^`\n]*`", "``", text)
    return re.sub(r"\]\([^)]*\)", "]", text)


def found_in(text: str) -> list[tuple[int, str, str]]:
    """Line, phrase and the field's term of each phrase of a page that is none."""
    text = prose(text)
    return [
        (text.count("\n", 0, found.start()) + 1, " ".join(found[0].lower().split()), term)
        for phrase, term in PHRASES.items()
        for found in re.finditer(rf"\b(?:{phrase})\b".replace(" ", r"\s+"), text, re.IGNORECASE)
    ]


def words_of(name: str) -> set[str]:
    """Lower-case words of a name, split at underscores and capitals."""
    return {word.lower() for part in name.split("_") for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", part)}


def public_names() -> set[str]:
    """Names that users write: classes, ``Class.member``, functions and parameters."""
    names = set[str]()
    for line in LIST.read_text(encoding="utf-8").splitlines():
        head, _, parameters = line.partition("(")
        names.add(head.removeprefix("class ").removeprefix("def ").removeprefix("value ").partition(":")[0])
        names.update(re.findall(r"\w+(?==|,|\))", parameters))
        if line.startswith("module "):
            names.discard(head)
            names.update(line.partition(": ")[2].split(", "))
    return names


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.relative_to(ROOT).as_posix())
def test_pages_use_the_terms_of_the_field(page: Path) -> None:
    name = page.relative_to(ROOT).as_posix()
    found = found_in(page.read_text(encoding="utf-8"))
    wrong = [f'{name}:{line}: "{phrase}" is {term}' for line, phrase, term in found if (name, phrase) not in QUOTED]
    assert not wrong, "\n".join(wrong)
    quoted = {phrase for place, phrase in QUOTED if place == name}
    assert quoted <= {phrase for _, phrase, _ in found}


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda effect: effect.name)
def test_effects_are_described_in_the_terms_of_the_field(effect: EffectType) -> None:
    meanings = (parameter.meaning for parameter in effect.parameters)
    texts = (effect.sentence, effect.impossible, *effect.confused_with.values(), *meanings)
    wrong = [f'"{phrase}" is {term}' for text in texts for _, phrase, term in found_in(text)]
    assert not wrong, "\n".join(wrong)


def test_modules_are_named_by_what_they_hold() -> None:
    files = [*(ROOT / "python" / "vpm").rglob("*.py"), *(ROOT / "crates").glob("*/src/**/*.rs")]
    modules = [path.parent if path.name in {"__init__.py", "mod.rs"} else path for path in files]
    wrong = {path.relative_to(ROOT).as_posix() for path in modules if words_of(path.stem) & MODULES}
    assert wrong == MODULES_THAT_STAY.keys()


def test_public_names_use_the_terms_of_the_field() -> None:
    wrong = {name for name in public_names() if words_of(name.rpartition(".")[2]) & NAMES}
    assert wrong == NAMES_THAT_STAY.keys()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("The data ask for\na spring.", ["data ask for"]),
        ("A play of 1 mm, `play`, [a](play.md).", ["play"]),
        ("```console\n$ vpm climb\n```\nA Pareto front.", []),
        ("Ladders of models", ["ladders"]),
        ("It is late.", []),
    ],
)
def test_the_check_sees(text: str, found: list[str]) -> None:
    assert [phrase for _, phrase, _ in found_in(text)] == found


def test_words_of_names() -> None:
    assert words_of("OwnRun_late2") == {"own", "run", "late"}
    assert words_of("to_CSVFile") == {"to", "csv", "file"}
