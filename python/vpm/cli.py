"""Command line ``vpm``: puts the commands together, one ``*_command.py`` each, and ends with their exit codes."""

import os
import signal
import sys
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from pathlib import Path
from threading import Event
from traceback import format_exception
from types import FrameType
from typing import Annotated, TextIO

import typer
from typer.core import TyperGroup

from vpm import __version__
from vpm.command import BESIDE, PICTURES, console, errors
from vpm.command_output import STOPPED, add_flags, asked, give, notes, speak, unexpected
from vpm.errors import INTERRUPTED, VpmError
from vpm.excite_command import app as excite_app
from vpm.files import exists

#: Commands in the order of the help, one ``*_command.py`` each, behind those of `excite`.
COMMANDS = (
    *("info", "check", "identify", "diagnose", "rank", "optimise", "prove", "study", "view", "import", "export"),
    *("reduce", "climb", "simplify", "budget", "compile", "simulate", "compare", "report", "linkage", "demo"),
)


class _Commands(TyperGroup):
    """The commands, run by `speak`; ``--plot`` of ``simulate`` may stand alone, also before its files."""

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        windows_expand_args: bool = True,
        **extra: object,
    ) -> object:
        """Run the command of a command line."""
        words = _with_picture(sys.argv[1:] if args is None else list(args))
        run = super().main

        def one(alone: bool) -> object:
            return run(words, prog_name, complete_var, standalone_mode and alone, windows_expand_args, **extra)

        return speak(one, asked(words, self._command(words)))

    def _command(self, words: list[str]) -> str:
        """Name of the command that a command line calls, such as "excite chirp"."""
        path, known = [], self.commands
        for word in words:
            if word in known:
                path.append(word)
                known = getattr(known[word], "commands", {})
        return " ".join(path)


def _with_picture(words: list[str]) -> list[str]:
    """Give ``--plot`` the value `BESIDE` where an option, a file or nothing follows it."""
    if next((word for word in words if not word.startswith("-")), "") != "simulate":
        return words
    full: list[str] = []
    for word, following in zip(words, [*words[1:], ""], strict=True):
        full.append(word)
        picture = Path(following).suffix.lower() in PICTURES
        other = not following or following.startswith("-") or exists(following)
        if word == "--plot" and other and not picture:
            full.append(BESIDE)
    return full


app = typer.Typer(
    cls=_Commands,
    name="vpm",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)
app.add_typer(excite_app, name="excite")
for name in COMMANDS:
    module = import_module(f"vpm.{name}_command")
    run = getattr(module, name, None) or getattr(module, f"{name}_")  # import and compile are words of Python
    app.command(name, epilog=module.EXAMPLES)(run)


def _version(asked: bool) -> None:
    if asked:
        give(version=__version__)
        console.print(f"vpm {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_version, help="Say which version this is.")
    ] = False,
) -> None:
    """Virtual prototype models: simulate a robot, compare it with logs, identify it, and name what is missing."""


def main() -> None:
    """Run the command line.

    An error of the input is one sentence and exit code 1. After Ctrl-C the exit code is 130, also of commands that
    then tell what they know.
    """
    pressed = Event()

    def press(number: int, frame: FrameType | None) -> None:
        pressed.set()
        signal.default_int_handler(number, frame)

    before = signal.getsignal(signal.SIGINT)
    if before is not signal.SIG_IGN:  # as a shell starts background work of a script
        signal.signal(signal.SIGINT, press)
    code: str | int | None = 0
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")  # letters that the encoding of a terminal does not have
    try:
        app()
    except SystemExit as end:
        code = end.code
    except VpmError as error:
        errors.print(f"error: {error}", markup=False)
        code = 1
    except KeyboardInterrupt:
        pressed.set()
    except BrokenPipeError:
        _let_go(sys.stdout)
        code = 1
    except BaseException as error:  # noqa: BLE001  # also a panic, and what libraries that load make of Ctrl-C
        code = 1
        if not pressed.is_set():
            _tell_unexpected(error)
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed.is_set():
        errors.print(STOPPED)
        code = INTERRUPTED
        exec("")  # noqa: S102  # clears a flag: `python -m` kills itself where Ctrl-C came in such a call
    if console.trouble or errors.trouble or notes.trouble:
        _tell_unwritten()
        code = code or 1
    sys.exit(code)


def _tell_unexpected(error: BaseException) -> None:
    if asked(sys.argv[1:]).verbose:
        errors.print("".join(format_exception(error)), markup=False)
    errors.print(f"error: {unexpected(error)}", markup=False)


def _tell_unwritten() -> None:
    """Say that the output could not be written, and let it go."""
    for one, stream in ((console, sys.stdout), (errors, sys.stderr), (notes, sys.stderr)):
        if one.trouble:
            _let_go(stream)
    if reason := console.trouble:
        what = reason.strerror or str(reason)
        errors.print(f"error: standard output cannot be written ({what[:1].lower()}{what[1:]}); send it elsewhere")


def _let_go(stream: TextIO) -> None:
    """Send what is left in a stream nowhere: it would be tried again at the end, with a traceback."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


add_flags(app)
