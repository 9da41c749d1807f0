"""The whole way through the program on the log that ships with it."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from vpm.compare import compare
from vpm.demo.files import MODEL, TRAIN, TRUTH, VALIDATION
from vpm.discrepancy import Diagnosis, diagnose
from vpm.experiment import Experiment
from vpm.model import Model
from vpm.report import print_story, write_report
from vpm.simulate import simulate


def run_demo(out: Path, console: Console, tell: Callable[[str], None]) -> Diagnosis:
    """Diagnose the demo's log, tell the story, write the report, and only then show what was hidden.

    Parameters
    ----------
    out : Path
        Folder for the report.
    console : rich.console.Console
    tell : callable
        Called with a sentence at every step.
    """

    def say(text: str = "") -> None:
        console.print(text, markup=False)

    model = Model.load(MODEL)
    training, unseen = (Experiment.load(path, model=model) for path in (TRAIN, VALIDATION))
    say(f"1. The model file describes {model.name}: {', '.join(model.bodies)} on {', '.join(model.joints)}.")
    say(f"2. Two logs of the machine: {training.name} to learn from, {unseen.name} to judge by.")
    tell("simulating the nominal model in closed loop")
    run = simulate(model, unseen, "closed_loop")
    say("3. Simulating the unseen log with the model as it stands:")
    say(f"   {compare(run, unseen)}".replace("\n", "\n   "))
    say("4. Looking for what is missing.")
    say()
    diagnosis = diagnose(model, training, unseen, tell=tell)
    print_story(diagnosis, console)
    say()
    _reveal(diagnosis, say)
    for path in write_report(diagnosis, out):
        say(f"wrote {path}")
    return diagnosis


def _reveal(diagnosis: Diagnosis, say: Callable[[str], None]) -> None:
    """Compare with the truth, which nothing above has read."""
    truth = tomllib.loads(TRUTH.read_text(encoding="utf-8"))
    hidden = truth["hidden"]
    found = [f"{e.name} at {e.site}" for e in diagnosis.effects]
    say(f"what was hidden in the log: {hidden['effect']} at {hidden['at']}; found: {', '.join(found) or 'nothing'}")
    for name, value in {**hidden["parameters"], **truth["parameters"]}.items():
        if name in diagnosis.model.parameters:
            parameter = diagnosis.model.parameters[name]
            say(f"  {name}: true {value:.4g}, found {parameter.value:.4g} {parameter.unit}")
