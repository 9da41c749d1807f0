"""Command line of a ranking: ``vpm rank``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from vpm.command import (
    Channels,
    Effect,
    FoundHold,
    Integrator,
    Interpolate,
    Logs,
    ModelPath,
    Without,
    Workers,
    console,
    load_all,
    searching,
    to_try,
    writable,
)
from vpm.command_output import give, wrote
from vpm.numbers import rough_percent
from vpm.ranking import Ranking

EXAMPLES = (
    "Example:  vpm rank model.toml train.csv --validate test.csv --out better.toml\n\n"
    "Example:  vpm rank model.toml a.csv b.csv --without sensor_delay --most 1 --workers 1"
)
#: Effects that were tried and not taken, that are shown.
SHOWN = 5

Validate = Annotated[
    list[Path] | None, typer.Option(help="Record that decides nothing; the gap is told on it; repeat.")
]
Most = Annotated[int, typer.Option(min=1, help="Most effects to add.")]
Out = Annotated[
    Path | None, typer.Option(callback=writable, help="Write the model with what was found to this file (TOML).")
]


def rank(
    model: ModelPath,
    logs: Logs,
    validate: Validate = None,
    out: Out = None,
    effect: Effect = None,
    without: Without = None,
    most: Most = 4,
    channels: Channels = None,
    interpolate: Interpolate = False,
    integrator: Integrator = "auto",
    hold: FoundHold = "auto",
    workers: Workers = 0,
) -> None:
    """Order what a model could be missing by what it removes of the error, and add the best for as long as it counts.

    A third of each log is held back; neither a controller nor a start at rest is asked for.
    """
    from vpm.ranking import Settings
    from vpm.ranking import rank as ranked
    from vpm.simulate import Setup

    tried = to_try(effect, without)
    machine, records, held_out = load_all(model, logs, channels, interpolate, validate)
    with searching() as (tell, each):
        ranking = ranked(
            machine,
            records,
            held_out,
            effects=tried,
            settings=Settings(effects=most),
            setup=Setup(integrator, hold=hold),
            workers=workers or None,
            tell=tell,
            progress=each,
        )
    give(ranking=ranking)
    for line in lines_of(ranking):
        console.print(line, markup=False)
    if out is not None:
        wrote(ranking.model.save(out))


def lines_of(ranking: Ranking) -> Iterator[str]:
    """A ranking in lines: what was added, what was next, the gap on validation records, notes."""
    if ranking.interrupted:
        yield "stopped before all was tried: this is what was known until then"
    if ranking.hold != "zero_order":
        yield f"commands run from sample to sample ({ranking.hold}); simulate with this hold too"
    if not ranking.effects:
        yield f"{ranking.model.name}: no effect removes enough of the error to be added"
    for number, one in enumerate(ranking.effects, 1):
        yield f"{number}. {one.effect} at {one.place} removes {rough_percent(one.judgement.removed)} of the error power"
        yield f"     {ranking.model.effect(one.effect, one.site, one.side).sentence(ranking.model.parameters)}"
        if one.rivals:
            yield f"     these records do not tell it from {', '.join(one.rivals)}"
    taken = {one.key for one in ranking.effects}
    tried = ranking.rounds[-1] if ranking.rounds else ()
    others = [other for other in tried if other.key not in taken][:SHOWN]
    if others:
        yield "next, with what each would remove of what is left, and its size beside all effects of the model:"
    for other in others:
        told = other.judgement
        yield f"  {other.effect} at {other.place}: {rough_percent(told.least)}, size {rough_percent(told.size)}"
    for channel, gap in ranking.gaps.items():
        levels = (
            f"{gap.before:.4g} before, {gap.recalibrated:.4g} with fitted parameters, {gap.after:.4g} {gap.unit} now"
        )
        yield f"{channel}, validation, root mean square beside a slow observer: {levels}"
    for note in ranking.notes:
        yield f"note: {note}"
