"""What was found, for people: a fit as lines, and as files: the fitted model, a table, a report, a picture."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from vpm.errors import MissingExtraError
from vpm.experiment import Experiment
from vpm.files import make_folder, replacing, write_text
from vpm.identify.fit_result import Fit
from vpm.identify.intervals import Bootstrap, Profile, bootstrap, profile_intervals
from vpm.identify.problem import Gaps
from vpm.simulate import HOLDS

_COLUMNS = ("name", "start", "value", "std", "low", "high", "unit")


def told(fit: Fit) -> list[str]:
    """Export of a fit as lines: values with deviations, first states, offsets, starts, noise, warnings."""
    lines = [_line(*row) for row in zip(fit.names, fit.values, fit.std, fit.units, strict=True)]
    lines += [_line(label, value, fit.states_std[label], "first state") for label, value in fit.states.items()]
    lines += [_line(label, value, fit.offsets_std[label], "offset") for label, value in fit.offsets.items()]
    if fit.costs.size > 1:
        lines.append(f"{fit.agreeing} of {fit.costs.size} starts agree")
    lines += [f"noise of {channel}: {level:.4g}" for channel, level in fit.noise.items()]
    lines += [f"first states: {fit.first_states}"] if fit.first_states else []
    if fit.mode == "inverse_dynamics" and not fit.expected.size:
        held = fit.setup is None or fit.setup.course == HOLDS[0]
        why = "no simulation of the model stays by the records" if held else "simulations beside a log hold commands"
        lines.append(f"{why}: intervals are those of inverse dynamics alone")
    lines += fit.warnings
    lines += [
        f"residual {channel}: {rms:.4g} {unit}, {_of_the_signal(share)}"
        for channel, (rms, share, unit) in fit.after.items()
    ]
    return lines


def _line(name: str, value: float, std: float, unit: str) -> str:
    return f"{name:40s} {value:14.6g} ± {std:<10.3g} {unit}"


def told_unseen(judged: tuple[Gaps, Gaps]) -> list[str]:
    """Export of validation errors, before and after a fit, a line each."""
    before, after = judged
    return [
        f"unseen {channel}: {rms:.4g} {unit}, {_of_the_signal(share)}; before it {before[channel][0]:.4g}"
        for channel, (rms, share, unit) in after.items()
    ]


def _of_the_signal(share: float) -> str:
    return f"{100 * share:.2f} % of the signal" if math.isfinite(share) else "of a signal that does not change"


def intervals(
    fit: Fit, records: Sequence[Experiment], profile: Sequence[str], replicates: int, seed: int, cutoff: float | None
) -> list[Profile | Bootstrap]:
    """Intervals to export: by profile of some parameters, and by bootstrap if ``replicates`` are asked for."""
    found: list[Profile | Bootstrap] = []
    if profile:
        found += profile_intervals(fit, records, profile, cutoff=cutoff)
    if replicates:
        found.append(bootstrap(fit, records, replicates=replicates, seed=seed, cutoff=cutoff))
    return found


def told_intervals(found: Sequence[Profile | Bootstrap]) -> list[str]:
    """Export of profile and bootstrap intervals of a fit as lines, one each."""
    lines = []
    for one in found:
        if isinstance(one, Profile):
            lines.append(f"{one.name}, profile: {one.low:.6g} to {one.high:.6g} {one.unit}")
            continue
        lines.append(f"bootstrap, {len(one.values)} times {one.drawn}:")
        lines += [
            f"{name}, bootstrap: {low:.6g} to {high:.6g} {unit}"
            for name, (low, high), unit in zip(one.names, one.intervals, one.units, strict=True)
        ]
    return lines


def write_fit(fit: Fit, folder: Path, lines: Sequence[str] = ()) -> list[Path]:
    """Export ``model.toml``, ``parameters.csv``, ``report.md``, ``fit.npz`` and, with extra ``plot``, ``fit.png``.

    ``folder``: made if it is not there; ``lines``: what was told of the fit, for the report.
    Result: what was written.
    """
    make_folder(folder)
    write_text(folder / "report.md", _report(fit, lines))
    with replacing(folder / "parameters.csv") as beside, beside.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(_COLUMNS)
        table.writerows(_rows(fit))
    fit.model.save(folder / "model.toml")
    written = [folder / name for name in ("model.toml", "parameters.csv", "report.md")] + [fit.save(folder / "fit.npz")]
    try:
        figure = fit.plot()
    except MissingExtraError:  # a plain install draws nothing
        return written
    with replacing(folder / "fit.png") as beside:
        figure.savefig(beside)
    return [*written, folder / "fit.png"]


def _rows(fit: Fit) -> list[tuple[object, ...]]:
    each = zip(fit.names, fit.start, fit.values, fit.std, fit.intervals, fit.units, strict=True)
    return [
        (name, float(start), float(value), float(std), float(low), float(high), unit)
        for name, start, value, std, (low, high), unit in each
    ]


def _report(fit: Fit, lines: Sequence[str]) -> str:
    records = ", ".join(fit.experiments)
    rows = [
        f"| {name} | {start:.6g} | {value:.6g} | {low:.6g} | {high:.6g} | {unit} |"
        for name, start, value, _, low, high, unit in _rows(fit)
    ]
    return "\n".join(
        [
            f"# {fit.model.name}: identification",
            "",
            f"Mode {fit.mode}, fitted to {records}, after {fit.evaluations} evaluations. Intervals of 95 %, SI units.",
            "",
            "| parameter | start | value | from | to | unit |",
            "| --- | --- | --- | --- | --- | --- |",
            *rows,
            "",
            *(f"- {line}" for line in lines),
            "",
        ]
    )
