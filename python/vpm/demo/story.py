"""The whole way through the program on the log that ships with it."""

import tomllib
from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from vpm.catalogue import EFFECTS
from vpm.compare import compare
from vpm.demo.hidden import HIDDEN, LISTED, REFUSED
from vpm.diagnosing import diagnose
from vpm.discrepancy import Diagnosis
from vpm.errors import DiagnosisError, near_match
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.report import print_story, write_report
from vpm.simulate import simulate

FOLDER = Path(__file__).parent
"""The folder that holds the demo's files."""

MODEL = FOLDER / "model.toml"
"""What the machine's builder believes: rough values, and one effect missing."""

TRAIN = FOLDER / "train.csv"
"""The record that the diagnosis learns from."""

VALIDATION = FOLDER / "validation.csv"
"""Another motion of the same machine, for checking on validation data."""

TRUTH = FOLDER / "truth.toml"
"""The hidden effect and the true values. Only shown at the end, never read by the diagnosis."""


def run_demo(
    out: Path,
    console: Console,
    tell: Callable[[str], None],
    hide: str | None = None,
    wrote: Callable[..., None] | None = None,
) -> Diagnosis:
    """Diagnose the demo's log, tell the story, write the report, and only then show what was hidden.

    ``hide``: another effect to hide, of `vpm.demo.hidden.LISTED`; its log is made first, into the folder ``log`` in
    ``out``.
    """

    def say(text: str = "") -> None:
        console.print(text, markup=False)

    folder = FOLDER
    if hide is not None:
        check_hidden(hide)
        tell(f"simulating a machine with {hide}")
        folder = out / "log"
        # Not at the top: the module is run as a program too, which wants to load it first.
        from vpm.demo.generate import generate

        generate(folder, hide)
    model = Model.load(folder / MODEL.name)
    training, validation = (Experiment.load(folder / path.name, model=model) for path in (TRAIN, VALIDATION))
    say(f"1. The model file describes {model.name}: {', '.join(model.bodies)} on {', '.join(model.joints)}.")
    say(f"2. Two logs of the machine: {training.name} to learn from, {validation.name} to judge by.")
    tell("simulating the nominal model in closed loop")
    run = simulate(model, validation, "closed_loop")
    say("3. Simulating the validation log with the model as it stands:")
    say(f"   {compare(run, validation)}".replace("\n", "\n   "))
    say("4. Looking for what is missing.")
    say()
    diagnosis = diagnose(model, training, validation, tell=tell)
    print_story(diagnosis, console)
    say()
    _reveal(diagnosis, folder / TRUTH.name, say)
    written = write_report(diagnosis, out)
    if wrote is not None:
        wrote(*written)
    return diagnosis


def check_hidden(name: str) -> None:
    """Refuse an effect that the demo's story cannot hide."""
    if name in LISTED:
        return
    if name in REFUSED:
        raise DiagnosisError(f"the demo cannot hide {name}: {REFUSED[name]}; choose from vpm demo --list")
    raise DiagnosisError(f'the demo cannot hide "{name}"; {near_match(name, LISTED)}')


def print_list(console: Console) -> list[dict[str, str]]:
    """Print what the demo's story can hide, a line each, with site and law.

    Result: name, site and law of each.
    """
    rows = []
    for name in LISTED:
        law = EFFECTS[name].law if name in EFFECTS else "nothing is missing; three values of the model are wrong"
        console.print(f"{name:22s}{HIDDEN[name].site:10s}{law}", markup=False)
        rows.append({"name": name, "site": HIDDEN[name].site, "law": law})
    return rows


def _reveal(diagnosis: Diagnosis, path: Path, say: Callable[[str], None]) -> None:
    """Reveal the truth at the end of the demo's story, which nothing above has read."""
    truth = tomllib.loads(path.read_text(encoding="utf-8"))
    hidden = truth["hidden"]
    found = [f"{e.name} at {e.site}" for e in diagnosis.effects]
    true = [f"{name} at {site}" for name, site in hidden.get("beside", [])]
    true += [f"{hidden['effect']} at {hidden['at']}"] if hidden["at"] else []
    say(f"what was hidden in the log: {', '.join(true) or 'nothing'}; found: {', '.join(found) or 'nothing'}")
    for name, value in {**hidden["parameters"], **truth["parameters"]}.items():
        if name in diagnosis.model.parameters:
            parameter = diagnosis.model.parameters[name]
            say(f"  {name}: true {value:.4g}, found {parameter.value:.4g} {parameter.unit}")
