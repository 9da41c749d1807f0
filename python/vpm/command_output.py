"""Output of commands: consoles, and what ``--json``, ``--quiet`` and ``--verbose`` make of it."""

import json
import platform
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from functools import wraps
from importlib.metadata import version
from inspect import Parameter, signature
from itertools import takewhile
from time import perf_counter, process_time
from typing import Annotated, Any

import typer
from rich.console import Console

from vpm.errors import INTERRUPTED, MissingExtraWarning, PluginWarning, ValidityWarning, VpmError

#: Changes when a key of the document is renamed or removed; new keys may come at any time.
SCHEMA = 1
#: What stands in the document as an error after Ctrl-C.
STOPPED = "stopped by Ctrl-C"
TOLD = (ValidityWarning, PluginWarning, MissingExtraWarning)


class Output(Console):
    """Output console that falls silent where its file or disk takes no more; other work goes on."""

    trouble: OSError | None = None  #: Why it fell silent.

    def print(self, *objects: Any, **options: Any) -> None:  # noqa: ANN401
        """Print to the output console, until its file takes no more."""
        try:
            super().print(*objects, **options)
        except BrokenPipeError:  # whoever read it has seen enough
            raise
        except OSError as error:
            self.trouble, self.quiet = error, True


#: Results; progress and notes, which ``--quiet`` leaves out; errors.
console = Output(highlight=False, soft_wrap=True)
notes = Output(stderr=True, highlight=False, soft_wrap=True)
errors = Output(stderr=True, highlight=False, soft_wrap=True)

FLAGS = {
    "as_json": (("--json",), "Write one JSON document to standard output, and nothing else there."),
    "quiet": (("--quiet", "-q"), "Say results and errors only."),
    "verbose": (("--verbose", "-v"), "Say what is done and when, and where an unexpected error came from."),
}
"""Options of every command: parameter, words and help."""


@dataclass
class OutputOptions:
    """Output options of the command that runs now, and what it has printed."""

    json: bool = False
    quiet: bool = False
    verbose: bool = False
    command: str = ""  #: Its words, such as ``excite chirp``.
    result: dict[str, object] = field(default_factory=dict)  #: What it found, by name.
    #: What it wrote, and warned of.
    files: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    begin: float = field(default_factory=perf_counter)  #: When it began (s).


_now = OutputOptions()


def asked(words: Sequence[str], command: str = "") -> OutputOptions:
    """Output options that a command line has, even a faulty one."""
    flags = list(takewhile(lambda word: word != "--", words))
    short = "".join(word for word in flags if re.fullmatch("-[qv]+", word))
    return OutputOptions(
        "--json" in flags, "--quiet" in flags or "q" in short, "--verbose" in flags or "v" in short, command
    )


def give(**parts: object) -> None:
    """Output of a command's results: by name in a JSON document; texts for people are printed beside."""
    _now.result |= parts


def wrote(*paths: object) -> None:
    """Output of the files that a command wrote."""
    _now.files += map(str, paths)
    if not _now.quiet:
        for path in paths:
            console.print(f"wrote {path}", markup=False)


def note(text: str) -> None:
    """Output of a note that a user should know beside the results, once."""
    if text not in _now.notes:
        _now.notes.append(text)
        notes.print(text, markup=False)


def detail(text: str) -> None:
    """Output of what a command does now, with ``--verbose``."""
    if _now.verbose:
        progressed(text)


def progressed(text: str) -> None:
    """Output of a line of progress; with the time since the command began for ``--verbose``."""
    notes.print(f"[{perf_counter() - _now.begin:8.2f} s] {text}" if _now.verbose else text, markup=False)


def in_lines() -> bool:
    """Whether progress is output in lines, not by a bar that moves."""
    return _now.verbose or not notes.is_terminal


def speak(run: Callable[[bool], object], options: OutputOptions) -> object:
    """Run a command with its output options.

    ``run``: takes whether an error of usage is told, and ends the program, at once; gives the exit code.
    """
    global _now  # noqa: PLW0603  # one command runs at a time
    _now = options
    notes.quiet = options.quiet or notes.trouble is not None

    def checked(alone: bool) -> object:
        if options.quiet and options.verbose:
            raise VpmError("--quiet and --verbose ask for opposite things; leave one out")
        return run(alone)

    with _warnings_told(), _times_told():
        return _documented(checked) if options.json else checked(True)


def _documented(run: Callable[[bool], object]) -> object:
    """Run a command whose output is one JSON document, also where it fails."""
    trouble: BaseException | None = None
    code: object = 0
    with redirect_stdout(sys.stderr), console.capture() as said:  # libraries print too
        try:
            code = run(False)
        except SystemExit as end:
            code = end.code
        except BaseException as error:  # noqa: BLE001  # told in the document, and raised again
            trouble = error
    if code == INTERRUPTED:  # as typer tells of Ctrl-C
        trouble = KeyboardInterrupt()
    console.print(_document(said.get().splitlines(), trouble), markup=False, emoji=False)
    if trouble is None:
        sys.exit(code if isinstance(code, int) else 0)
    if (usage := getattr(trouble, "exit_code", None)) is not None:
        errors.print(f"error: {_told(trouble)['message']}", markup=False)
        sys.exit(usage)
    raise trouble


def _document(lines: list[str], trouble: BaseException | None) -> str:
    from vpm.json_values import plain  # it needs NumPy, which is slow to load

    document: dict[str, object] = {"schema": SCHEMA, "vpm": version("vpm-dynamics"), "command": _now.command}
    document |= {"error": _told(trouble)} if trouble is not None else {}
    document |= {"result": _now.result, "text": lines, "files": _now.files, "notes": _now.notes}
    return json.dumps(plain(document), indent=2, allow_nan=False)


def _told(trouble: BaseException) -> dict[str, object]:
    """JSON output of an error: its class, sentence and facts."""
    if isinstance(trouble, VpmError):
        facts = {k: v for k, v in vars(trouble).items() if v is None or isinstance(v, str | int | float | tuple)}
        return {"kind": type(trouble).__name__, **facts, "message": str(trouble)}
    if isinstance(trouble, KeyboardInterrupt | typer.Abort):
        return {"kind": "Interrupted", "message": STOPPED}
    if (usage := getattr(trouble, "format_message", None)) is not None:
        return {"kind": "UsageError", "message": usage()}
    return {"kind": type(trouble).__name__, "message": unexpected(trouble)}


def unexpected(trouble: BaseException) -> str:
    """Output sentence for an error that vpm should have made one of its own."""
    return (
        f"vpm met an unexpected {type(trouble).__name__} ({trouble}), which is a mistake of vpm: run this again with "
        "--verbose for the place of it, and report both"
    )


@contextmanager
def _warnings_told() -> Iterator[None]:
    """Output of vpm's warnings as one sentence each, without lines of code."""
    with warnings.catch_warnings():
        for kind in TOLD:
            warnings.simplefilter("always", kind)
        others = warnings.showwarning

        def tell(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:  # noqa: ANN401
            if issubclass(category, TOLD):
                note(f"warning: {message}")
            else:
                others(message, category, *where, **more)

        warnings.showwarning = tell
        yield


@contextmanager
def _times_told() -> Iterator[None]:
    detail(f"vpm {version('vpm-dynamics')}, Python {platform.python_version()}, NumPy {version('numpy')}")
    try:
        yield
    finally:
        spent = process_time()
        detail(f"{_now.command or 'vpm'} took {perf_counter() - _now.begin:.2f} s; the process used {spent:.2f} s")


def add_flags(app: typer.Typer) -> None:
    """Add the output options `FLAGS` to every command of an application; `asked` reads them."""
    for group in app.registered_groups:
        if group.typer_instance is not None:
            add_flags(group.typer_instance)
    for one in (app.registered_callback, *app.registered_commands):
        if one is not None and one.callback is not None:
            one.callback = with_flags(one.callback)


def with_flags(command: Callable[..., Any]) -> Callable[..., Any]:
    """Command that takes the output options `FLAGS` too."""

    @wraps(command)
    def run(**given: Any) -> Any:  # noqa: ANN401
        return command(**{name: value for name, value in given.items() if name not in FLAGS})

    own = signature(command, eval_str=True)
    flags = [_flag(name, *of) for name, of in FLAGS.items()]
    run.__signature__ = own.replace(parameters=[*own.parameters.values(), *flags])  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in (*own.parameters.values(), *flags)}
    return run


def _flag(name: str, words: tuple[str, ...], told: str) -> Parameter:
    kind = Annotated[bool, typer.Option(*words, help=told)]
    return Parameter(name, Parameter.KEYWORD_ONLY, default=False, annotation=kind)
