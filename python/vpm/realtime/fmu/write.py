"""One file that other simulators load: description, sources and, where a compiler is at hand, a library."""

import hashlib
import math
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from importlib.resources import files
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from numpy.typing import ArrayLike

from vpm.errors import SimulationError
from vpm.files import probe_file, replacing
from vpm.model import Model
from vpm.realtime.fmu.description import build_description, model_description
from vpm.realtime.fmu.variables import Variables, variables
from vpm.realtime.source import CSource, c_source
from vpm.simulate import AUTOMATIC

#: Steps that the C source has.
STEPS = ("rosenbrock", "rk4")
#: Most steps of an FMU's own in one communication step, as the core has it for a sample.
MOST_STEPS = 1_000_000
_PARTS = ("fmu_steps.h", "fmu_keeping.h", "fmu_absent.h")
#: As files in an FMU are dated, so that the same model gives the same bytes.
_DATE = (1980, 1, 1, 0, 0, 0)

_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("windows", ".dll")}
_PROCESSORS = {"amd64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
#: In C99 mode compilers contract no operations, so that all machines round alike.
_OPTIONS = ("-std=c99", "-fPIC", "-shared", "-fvisibility=hidden", "-DFMI3_OVERRIDE_FUNCTION_PREFIX=1")
#: Characters of a source that are optimised in seconds; larger ones, of links with many coordinates, take minutes.
_LARGE = 500_000


@dataclass(frozen=True)
class Fmu:
    """An FMU that was written.

    Attributes
    ----------
    identifier : str
        What its files, and its functions in C, are called.
    token : str
        Its instantiation token: a hash of all that it computes.
    inputs, states, outputs, parameters : tuple of str
        Names of its variables.
    step : float
        Longest step of its own, s.
    platform : str or None
        What its library runs on; None where it has sources alone.
    notes : tuple of str
        What differs from a simulation of the model, and why there is no library.
    """

    path: Path
    identifier: str
    token: str
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    step: float
    integrator: str
    platform: str | None
    notes: tuple[str, ...]


def write_fmu(
    model: Model,
    path: str | PathLike[str],
    *,
    rate: float = 1000.0,
    integrator: str = AUTOMATIC,
    substeps: int = 1,
    parameters: Sequence[str] = (),
    state: Mapping[str, float] | ArrayLike | None = None,
    name: str | None = None,
    library: bool | None = None,
) -> Fmu:
    """Write a model as an FMU of FMI 3.0, for co-simulation and model exchange, with exact directional derivatives.

    Inputs are held through a communication step. The model's controllers rest, and delays pass their signals
    unchanged, as in :func:`vpm.realtime.c_source`.

    Parameters
    ----------
    path : path-like
        The file, ``machine.fmu``.
    rate : float
        Communication points per second that the FMU suggests, Hz.
    integrator : {"auto", "rosenbrock", "rk4"}
        Steps of co-simulation; ``auto`` is ``rosenbrock``.
    substeps : int
        The FMU's own steps are at most ``1 / (rate substeps)`` long; each communication step is divided evenly.
    parameters : sequence of str
        Names or patterns, such as ``"*.mass"``, of parameters that can be set; all others are constants.
    state : mapping of str to float, or array_like of shape (nx,), optional
        Start values of the states, as ``model.state`` takes them.
    name : str, optional
        What files and functions are called; made of the model's name by default.
    library : bool, optional
        Whether the library for this platform is made beside the sources. By default it is where there is a C compiler.

    Raises
    ------
    SimulationError
        A setting is wrong, the model cannot be written in C, or the compiler fails.
    FileError
        The file cannot be written.
    """
    method, step = _steps(rate, integrator, substeps)
    probe_file(path)
    written = c_source(model, name=name, parameters=parameters)
    found = variables(model, written, model.state(state))
    identifier = written.name

    def described(token: str) -> str:
        tool = f"vpm {version('vpm-dynamics')}"
        return model_description(
            found, name=model.name, identifier=identifier, token=token, tool=tool, period=1.0 / rate, step=step
        )

    sources = _sources(written, found, method, step)
    token = _token(described(""), *sources.values())
    sources = {file: text.replace("FMU_TOKEN_TEXT", token) for file, text in sources.items()}
    compiled = [f"{identifier}.c", "fmu.c"]
    contents: dict[str, str | bytes] = {"modelDescription.xml": described(token)}
    contents |= {f"sources/{file}": text for file, text in sources.items()}
    contents["sources/buildDescription.xml"] = build_description(identifier, compiled)
    notes, platform = _notes(model), platform_name()
    wanted = compiler() is not None and platform is not None if library is None else library
    if wanted and platform is not None:
        place = f"binaries/{platform[0]}/{identifier}{platform[1]}"
        contents[place] = shared_library(sources, compiled)
    elif wanted:
        raise SimulationError("FMI 3.0 has no name for this platform that vpm knows; leave the library out")
    elif library is None:
        notes.append("there is no C compiler `cc` here, so the FMU has sources alone")
    _save(path, contents)
    names = ([one.name for one in kind] for kind in (found.inputs, found.states, found.outputs, found.parameters))
    inputs, states, outputs, free = map(tuple, names)
    runs_on = platform[0] if wanted and platform is not None else None
    return Fmu(Path(path), identifier, token, inputs, states, outputs, free, step, method, runs_on, tuple(notes))


def _steps(rate: float, integrator: str, substeps: int) -> tuple[str, float]:
    """Integrator and step length (s) to write into an FMU."""
    if not 0.0 < rate < math.inf:
        raise SimulationError(f"a rate of {rate:g} Hz is not possible; give a positive number")
    if substeps % 1 or not 1 <= substeps <= MOST_STEPS:
        raise SimulationError(f"substeps is {substeps}; give a whole number from 1 to {MOST_STEPS}")
    if integrator not in (AUTOMATIC, *STEPS):
        raise SimulationError(f"an FMU cannot step by '{integrator}'; choose {', '.join(STEPS)} or {AUTOMATIC}")
    return STEPS[0] if integrator == AUTOMATIC else integrator, 1.0 / (rate * substeps)


def _sources(written: CSource, found: Variables, method: str, step: float) -> dict[str, str]:
    """Source texts to write into an FMU, by file name; the token is not known yet."""
    here = files("vpm.realtime.fmu")
    texts = {file: here.joinpath(file).read_text(encoding="utf-8") for file in ("fmi3.h", "fmu.c", *_PARTS)}
    texts = {file: text.replace("NAME", written.name) for file, text in texts.items()}
    texts["fmu.c"] = texts["fmu.c"].replace("SETTINGS\n", _settings(written.name, found, method, step))
    return {f"{written.name}.h": written.header, f"{written.name}.c": written.source, **texts}


def _settings(name: str, found: Variables, method: str, step: float) -> str:
    tables = {
        "STATES": [one.start or 0.0 for one in found.states],
        "INPUTS": [one.start or 0.0 for one in found.inputs],
        "LEAST": [(one.bounds or (0.0, 0.0))[0] for one in found.parameters],
        "MOST": [(one.bounds or (0.0, 0.0))[1] for one in found.parameters],
    }
    lines = [
        '#define FMU_TOKEN "FMU_TOKEN_TEXT"',
        f"#define FMU_STEP {step!r}",
        f"#define FMU_MOST_STEPS {float(MOST_STEPS)!r}",
        f"#define FMU_STEP_BY {name}_step_{method}",
    ]
    # C knows no table without entries.
    lines += [
        f"static const double FMU_{what}[] = {{{', '.join(map(repr, [*values, 0.0]))}}};"
        for what, values in tables.items()
    ]
    return "\n".join(lines) + "\n"


def _token(*texts: str) -> str:
    digest = hashlib.sha256("\0".join(texts).encode()).hexdigest()
    return "{" + "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])) + "}"


def _notes(model: Model) -> list[str]:
    """Notes to write with an FMU on what it does not do as a simulation does."""
    notes = []
    if model.is_abrupt:
        notes.append(
            "contacts or hydraulic drives are abrupt, and steps of co-simulation are not divided where they are: "
            "take substeps, or model exchange with a solver that controls its error"
        )
    late = [name for name, p in model.parameters.items() if name.endswith(".delay.time") and p.value > 0.0]
    if late:
        notes.append(f"delays pass their signals unchanged: {', '.join(late)}")
    return notes


def _save(path: str | PathLike[str], contents: Mapping[str, str | bytes]) -> None:
    with replacing(path) as beside, ZipFile(beside, "w", ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            entry = ZipInfo(name, _DATE)
            entry.compress_type, entry.external_attr = ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, content)


def compiler() -> str | None:
    """C compiler for an FMU's binary: what ``CC`` names, or ``cc``."""
    return shutil.which(os.environ.get("CC") or "cc")


def platform_name() -> tuple[str, str] | None:
    """Platform of an FMU's binary, such as ``"x86_64-linux"``, and how its libraries end; or None."""
    system = _SYSTEMS.get(sys.platform)
    processor = _PROCESSORS.get(platform.machine().lower())
    return None if system is None or processor is None else (f"{processor}-{system[0]}", system[1])


def shared_library(sources: dict[str, str], files: list[str]) -> bytes:
    """Compile sources into an FMU's binary, a shared library.

    ``sources``: texts by file name; ``files``: which of them are compiled.
    """
    command = compiler()
    if command is None:
        raise SimulationError("there is no C compiler `cc` here for the FMU's library; install one, or leave it out")
    optimise = "-O2" if sum(map(len, sources.values())) <= _LARGE else "-O1"
    with TemporaryDirectory() as place:
        folder = Path(place)
        for name, text in sources.items():
            (folder / name).write_text(text, encoding="utf-8", newline="\n")
        words = [command, *_OPTIONS, optimise, *files, "-o", "library", "-lm"]
        try:
            done = subprocess.run(  # noqa: S603 - the compiler that the user has
                words, cwd=folder, capture_output=True, text=True, errors="replace", check=False
            )
        except OSError as error:
            raise SimulationError(f"the C compiler {command} does not start ({error}); install another") from error
        if done.returncode != 0:
            first = next((line for line in done.stderr.splitlines() if "error" in line), "it says nothing")
            raise SimulationError(
                f"the C compiler {command} fails ({first.strip()[:200]}); install another, or leave it out"
            )
        return (folder / "library").read_bytes()
