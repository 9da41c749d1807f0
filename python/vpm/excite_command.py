"""Command line of the design of excitations: ``vpm excite multisine``, ``chirp``, ``noise`` and ``fourier``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vpm.command import Plot, console, progress, save_plot, writable
from vpm.command_output import give, wrote
from vpm.errors import ExcitationError

if TYPE_CHECKING:
    from vpm.excitation import Excitation, JointLimits

app = typer.Typer(
    help="Design a command or a motion that shows what a model has to know, and write it as a table for the robot.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

Channel = Annotated[str, typer.Option(help="Channel as in the model, for example motor.command.")]
Unit = Annotated[str, typer.Option(help="Its unit.")]
Band = Annotated[tuple[float, float], typer.Option(help="Lowest and highest frequency, Hz.")]
TimeStep = Annotated[float, typer.Option(help="Time between samples, s.")]
Period = Annotated[float, typer.Option(help="Period, which is the duration of what does not repeat, s.")]
Peak = Annotated[float, typer.Option(help="Largest absolute value, in the unit.")]
Out = Annotated[Path, typer.Option(callback=writable, help="Table to write (CSV with units in its header).")]
Seed = Annotated[int, typer.Option(help="The same seed gives the same numbers.")]


@app.command(
    epilog="Example:  vpm excite multisine --channel motor.command --unit A --band 0.5 20 --period 4 "
    "--time-step 0.001 --peak 2 --out multisine.csv"
)
def multisine(
    channel: Channel,
    unit: Unit,
    band: Band,
    period: Period,
    time_step: TimeStep,
    peak: Peak,
    periods: Annotated[int, typer.Option(help="How often the period is repeated.")] = 1,
    odd: Annotated[bool, typer.Option(help="Odd multiples only, so that even ones show nonlinearity.")] = False,
    out: Out = Path("excitation.csv"),
    plot: Plot = None,
) -> None:
    """Sines at multiples of 1/period, with phases that keep the peaks low."""
    from vpm.excitation import multisine as design

    with _progress("crest factor") as tell:
        result = design(
            channel,
            unit,
            band=band,
            period=period,
            time_step=time_step,
            peak=peak,
            periods=periods,
            odd=odd,
            progress=tell,
        )
    _finish(result, out, plot)


@app.command(
    epilog="Example:  vpm excite chirp --channel motor.command --unit A --band 0.5 20 --period 10 "
    "--time-step 0.001 --peak 2 --out chirp.csv"
)
def chirp(
    channel: Channel,
    unit: Unit,
    band: Band,
    period: Period,
    time_step: TimeStep,
    peak: Peak,
    out: Out = Path("excitation.csv"),
    plot: Plot = None,
) -> None:
    """One sine whose frequency moves evenly from the first to the second of the band."""
    from vpm.excitation import chirp as design

    first, last = band
    result = design(channel, unit, first=first, last=last, amplitude=peak, duration=period, time_step=time_step)
    _finish(result, out, plot)


@app.command(
    epilog="Example:  vpm excite noise --channel motor.command --unit A --band 0 20 --period 10 "
    "--time-step 0.001 --rms 0.5 --out noise.csv"
)
def noise(
    channel: Channel,
    unit: Unit,
    band: Band,
    period: Period,
    time_step: TimeStep,
    rms: Annotated[float, typer.Option(help="Root mean square, in the unit.")],
    peak: Annotated[float | None, typer.Option(help="Refuse noise beyond this absolute value.")] = None,
    seed: Seed = 0,
    out: Out = Path("excitation.csv"),
    plot: Plot = None,
) -> None:
    """Gaussian noise of a flat spectrum within the band."""
    from vpm.excitation import noise as design

    result = design(channel, unit, band=band, rms=rms, duration=period, time_step=time_step, seed=seed, peak=peak)
    _finish(result, out, plot)


@app.command(
    epilog="Example:  vpm excite fourier model.toml limits.toml --period 10 --time-step 0.002 --out motion.csv\n\n"
    "limits.toml:  [shoulder]  position = [-1.5, 1.5]  speed = 3.0  acceleration = 15.0  effort = 12.0"
)
def fourier(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="Model file (TOML).")],
    limits: Annotated[
        Path, typer.Argument(metavar="LIMITS", help="Limits in SI units, a table for each joint (TOML).")
    ],
    period: Period,
    time_step: TimeStep,
    harmonics: Annotated[int, typer.Option(help="Harmonics of each joint.")] = 5,
    free: Annotated[
        list[str] | None, typer.Option(help="Dotted parameter name; repeat. Default: all with an uncertainty.")
    ] = None,
    criterion: Annotated[str, typer.Option(help="condition or determinant.")] = "condition",
    evaluations: Annotated[int, typer.Option(help="Motions to try.")] = 1500,
    seed: Seed = 0,
    out: Out = Path("excitation.csv"),
    plot: Plot = None,
) -> None:
    """Periodic motion within limits that tells the parameters of a model best."""
    from vpm.excitation import fourier_trajectory
    from vpm.model import Model

    machine = Model.load(model)
    with _progress("criterion") as tell:
        result = fourier_trajectory(
            machine,
            _limits(limits),
            period=period,
            time_step=time_step,
            harmonics=harmonics,
            free=free,
            criterion=criterion,  # type: ignore[arg-type]  # refused there with the choices
            starts=min(20, evaluations),
            evaluations=evaluations,
            seed=seed,
            progress=tell,
        )
    _finish(result, out, plot)


def _limits(path: Path) -> dict[str, JointLimits]:
    from vpm.excitation import JointLimits
    from vpm.model.reading import read_toml

    limits = {}
    for joint, values in read_toml(path).items():
        try:
            low, high = values["position"]
            numbers = {name: float(values[name]) for name in ("speed", "acceleration", "effort") if name in values}
            limits[joint] = JointLimits((float(low), float(high)), **numbers)
        except (KeyError, TypeError, ValueError) as error:
            if isinstance(error, ExcitationError):
                raise ExcitationError(f"{path}, [{joint}]: {error}") from error
            raise ExcitationError(
                f"{path}: [{joint}] is no table of limits ({error}); write position = [low, high], speed and "
                "acceleration, and effort if it is limited"
            ) from error
    return limits


def _finish(result: Excitation, out: Path, plot: Path | None) -> None:
    give(excitation=result)
    console.print(repr(result), markup=False)
    for note in result.notes:
        console.print(f"  {note}", markup=False)
    wrote(result.to_csv(out))
    save_plot(result.plot, plot)


@contextmanager
def _progress(what: str) -> Iterator[Callable[[int, float], None]]:
    """A line on the terminal, some lines in a file."""
    with progress() as tell:
        yield lambda count, value: tell(f"{count}: {what} {value:.5g}")
