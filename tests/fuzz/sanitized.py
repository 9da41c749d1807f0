"""``python -m fuzz.sanitized LIBRARY`` in the folder of the tests: what is compiled from C, watched by sanitizers.

The C source of each example, and a program in C that calls the library with wrong arguments.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

from fuzz.doors import EXAMPLES, MODELS
from vpm import Model, write_fmu
from vpm.errors import VpmError
from vpm.realtime import c_source, compile_model

HERE = Path(__file__).parent / "c"
ROOT = Path(__file__).parents[2]
WATCHED = ("-g", "-O1", "-Wall", "-Wextra", "-Werror", "-fsanitize=address,undefined,float-cast-overflow")
#: Nothing is repaired and gone on with; what is never freed is a mistake too.
STRICT = (*WATCHED, "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")
#: Characters of a source that a compiler takes minutes to watch.
LARGE = 500_000
#: Levels of flexible links whose source is not so large.
COARSE = {"tudor/tudor": "bezier(3)", "flexible_pendulum/flexible_pendulum": "bezier(3)"}
#: What is small: the functions of an FMU are the same for all machines.
FMUS = ("emps/model", "wrist/wrist", "hyl/rcm")
VALGRIND = (
    "valgrind",
    "--quiet",
    "--error-exitcode=9",
    "--leak-check=full",
    "--show-leak-kinds=definite",
    "--errors-for-leak-kinds=definite",
)


def run(what: str, command: list[str], folder: Path) -> bool:
    """Run a command and tell how it ended."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env={**os.environ})
    print(f"{what}: {'well' if done.returncode == 0 else 'WRONG'} {done.stdout.strip()}", flush=True)
    if done.returncode:
        print(done.stderr[-4000:], flush=True)
    return done.returncode == 0


def source(name: str, folder: Path) -> bool:
    """The C source of a model."""
    try:
        model = Model.load(EXAMPLES / f"{name}.toml")
        written = c_source(model.at(COARSE[name]) if name in COARSE else model, name="machine")
    except VpmError as error:
        print(f"{name}: no C source ({error})", flush=True)
        return True
    if len(written.source) > LARGE:
        print(f"{name}: left out, {len(written.source)} characters", flush=True)
        return True
    written.save(folder)
    words = ["-DNAME=machine", '-DHEADER="machine.h"', "-I.", str(HERE / "source.c"), "machine.c", "-lm"]
    built = run(f"{name}, compiled", ["cc", "-std=c99", *STRICT, *words, "-o", "source"], folder)
    return built and run(f"{name}, called", ["./source", "200"], folder)


def fmu(name: str, folder: Path) -> bool:
    """The FMU of a machine, called as an importer does, with hostile numbers too."""
    written = write_fmu(Model.load(EXAMPLES / f"{name}.toml"), folder / "machine.fmu", name="machine", library=False)
    with zipfile.ZipFile(written.path) as archive:
        archive.extractall(folder)
    rate = 1 + len(written.inputs) + len(written.states)
    files = [str(HERE / "fmu.c"), "sources/machine.c", "sources/fmu.c", "-lm"]
    words = [
        "-DFMI3_OVERRIDE_FUNCTION_PREFIX=1",
        f'-DTOKEN="{written.token}"',
        f"-DTHE_RATE={rate}",
        "-Isources",
        *files,
    ]
    built = run(f"{name} as FMU, compiled", ["cc", "-std=c99", *STRICT, *words, "-o", "fmu"], folder)
    return built and run(f"{name} as FMU, called", ["./fmu"], folder)


def interface(library: Path, folder: Path) -> bool:
    """The library, called from C."""
    paths = []
    for name in MODELS:
        try:
            path = folder / f"{name.replace('/', '_')}.json"
            path.write_text(compile_model(Model.load(EXAMPLES / f"{name}.toml"), 1000.0).text, encoding="utf-8")
            paths.append(str(path))
        except VpmError as error:
            print(f"{name}: not compiled ({error})", flush=True)
    words = ["-I", str(ROOT / "crates/vpm-c/include"), str(HERE / "interface.c"), str(library)]
    words += ["-lpthread", "-ldl", "-lm"]
    well = run("interface, compiled", ["cc", "-std=c99", *STRICT, *words, "-o", "interface"], folder)
    well = well and run("interface, called", ["./interface", *paths], folder)
    if shutil.which("valgrind"):
        # Sees what the library itself reads and writes, which no sanitizer watches.
        built = run("interface for valgrind", ["cc", "-std=c99", "-g", *words, "-o", "plain"], folder)
        well &= built and run("interface in valgrind", [*VALGRIND, "./plain", *paths[:2]], folder)
    return well


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        ended = [source(name, Path(place)) for name in MODELS]
        ended += [fmu(name, Path(place)) for name in FMUS]
        ended.append(interface(Path(sys.argv[1]).resolve(), Path(place)))
    sys.exit(0 if all(ended) else 1)
