"""Time one step of a NARX model of 20 terms beside others: plain Python, sysidentpy, Numba and C, those that are there.

Every candidate simulates the same free run of the same model from the same start; runs that differ are not timed. The
candidates take turns, and each line gives the median and the quartiles of all rounds, so that what else the machine
does meets all of them.
"""

from __future__ import annotations

import argparse
import ctypes
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vpm.narx import Narx

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "support"), str(ROOT / "benches" / "peers")]


Array = NDArray[np.float64]
Ints = NDArray[np.int32]
SAMPLES, ROUNDS, LAG = 20_000, 15, 3

GENERIC_C = """
void run(int n, int terms, const int *degree, const int *signal, const int *delay, const double *theta,
         const double *u, double *y) {
    for (int k = %d; k < n; k++) {
        double sum = 0.0;
        for (int i = 0; i < terms; i++) {
            double product = theta[i];
            for (int j = 0; j < degree[i]; j++)
                product *= (signal[3 * i + j] ? u : y)[k - delay[3 * i + j]];
            sum += product;
        }
        y[k] = sum;
    }
}
"""


def twenty() -> Narx:
    """One constant, 5 linear, 7 quadratic and 7 cubic terms."""
    factors = [(0, 1), (0, 2), (0, 3), (1, 1), (1, 2)]
    square = [(factors[i], factors[j]) for i in range(5) for j in range(i, 5)][:7]
    cubic = [(factors[i], factors[j], factors[k]) for i in range(5) for j in range(i, 5) for k in range(j, 5)][:7]
    terms = [(), *((one,) for one in factors), *square, *cubic]
    return Narx.from_terms("y", ["u"], terms, [0.05 / (1 + at) for at in range(len(terms))])


def arrays(model: Narx) -> tuple[Ints, Ints, Ints]:
    """Degree of each term, and signals and lags of its factors."""
    degree = np.array([len(term) for term in model.terms], np.int32)
    signal, delay = np.zeros((20, 3), np.int32), np.zeros((20, 3), np.int32)
    for at, term in enumerate(model.terms):
        for place, (number, lag) in enumerate(term):
            signal[at, place], delay[at, place] = number, lag
    return degree, signal, delay


def loop(n: int, degree: Ints, signal: Ints, delay: Ints, theta: Array, u: Array, y: Array) -> Array:
    """The difference equation over a table of terms."""
    for k in range(3, n):
        total = 0.0
        for i in range(theta.size):
            product = theta[i]
            for j in range(degree[i]):
                at = k - delay[i, j]
                product *= u[at] if signal[i, j] else y[at]
            total += product
        y[k] = total
    return y


def compiled(source: str, folder: Path, name: str, *options: str) -> Callable[..., object] | None:
    """A C function, or None without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        return None
    path = folder / f"{name}.c"
    path.write_text(source, encoding="utf-8")
    library = folder / f"{name}.so"
    command = [compiler, "-O3", "-march=native", *options, "-shared", "-fPIC", str(path), "-o", str(library)]
    subprocess.run(command, check=True)  # noqa: S603
    return ctypes.CDLL(str(library)).run


def unrolled(model: Narx) -> str:
    """The model written out, term by term."""
    written = [
        " * ".join([repr(float(value)), *(f"{'yu'[signal]}[k - {lag}]" for signal, lag in term)])
        for value, term in zip(model.coefficients, model.terms, strict=True)
    ]
    body = " + ".join(written)
    return f"void run(int n, const double *u, double *y) {{ for (int k = {LAG}; k < n; k++) y[k] = {body}; }}"


def pointer(array: NDArray[Any]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


def c_candidates(model: Narx, u: Array, folder: Path) -> dict[str, Callable[[], Array]]:
    generic = compiled(GENERIC_C % LAG, folder, "generic")
    written = compiled(unrolled(model), folder, "unrolled")
    reordered = compiled(unrolled(model), folder, "reordered", "-ffast-math")
    if generic is None or written is None or reordered is None:
        print("no C compiler here")
        return {}
    parts = arrays(model)

    def by_table() -> Array:
        y = np.zeros(u.size)
        generic(u.size, 20, *map(pointer, parts), pointer(model.coefficients), pointer(u), pointer(y))
        return y

    def written_out(function: Callable[..., object]) -> Array:
        y = np.zeros(u.size)
        function(u.size, pointer(u), pointer(y))
        return y

    return {
        "C, loop over a table": by_table,
        "C, written out": lambda: written_out(written),
        "C, written out, fast-math": lambda: written_out(reordered),
    }


def numba_candidate(model: Narx, u: Array) -> dict[str, Callable[[], Array]]:
    try:
        from numba import njit
    except ImportError:
        print("numba is not installed")
        return {}
    fast, parts = njit(loop), arrays(model)
    return {"Numba": lambda: fast(u.size, *parts, model.coefficients, u, np.zeros(u.size))}


def sysidentpy_candidate(model: Narx, u: Array) -> dict[str, Callable[[], Array]]:
    try:
        from narx_peer import fitted
    except ImportError:
        return {}
    try:
        theirs = fitted(np.sin(np.arange(200.0)), u[:200], lags=LAG, degree=3, n_terms=20)
    except ImportError:
        print("sysidentpy is not installed")
        return {}
    code = np.zeros((20, 3), int)
    for at, term in enumerate(model.terms):
        code[at, : len(term)] = sorted(((1 + signal) * 1000 + lag for signal, lag in term), reverse=True)
    theirs.final_model, theirs.theta = code, model.coefficients[:, None]
    return {"sysidentpy": lambda: theirs.predict(X=u[:, None], y=np.zeros((LAG, 1)))[:, 0]}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--markdown", type=Path, help="write the section of the performance page here")
    options = parser.parse_args()
    model, u = twenty(), np.random.default_rng(1).uniform(-1.0, 1.0, SAMPLES)
    start = np.zeros(SAMPLES)
    core, table = model._compiled, u[:, None]  # noqa: SLF001  # the crossing alone, without the result object
    parts = arrays(model)
    short = 1000
    candidates: dict[str, tuple[int, Callable[[], Array]]] = {
        "vpm, run object": (SAMPLES, lambda: model.simulate_free_run({"y": start, "u": u}).values),
        "vpm, one call": (SAMPLES, lambda: core.simulate_free_run("noise", start, table, 1e6)),
        "Python loop": (short, lambda: loop(short, *parts, model.coefficients, u, np.zeros(short))),
    }
    with tempfile.TemporaryDirectory() as folder:
        compiled_ones = c_candidates(model, u, Path(folder)) | numba_candidate(model, u)
        candidates |= {name: (SAMPLES, run) for name, run in compiled_ones.items()}
        candidates |= {name: (short, run) for name, run in sysidentpy_candidate(model, u[:short]).items()}
        text = measure(candidates)
    print(text)
    if options.markdown:
        options.markdown.write_text(text, encoding="utf-8")


def measure(candidates: dict[str, tuple[int, Callable[[], Array]]]) -> str:
    """A line for each engine, and how far quartiles and values are apart."""
    expected = candidates["vpm, one call"][1]()
    times: dict[str, list[float]] = {}
    differences: dict[str, float] = {}
    for name, (samples, run) in candidates.items():
        difference = float(np.abs(run()[:samples] - expected[:samples]).max())
        if difference > 1e-12:
            print(f"{name}: differs by {difference:.1e}, not timed")
        else:
            times[name], differences[name] = [], difference
    for _ in range(ROUNDS):
        for name, taken in times.items():
            samples, run = candidates[name]
            began = time.perf_counter()
            run()
            taken.append((time.perf_counter() - began) / samples * 1e9)
    base = float(np.median(times["vpm, one call"]))
    lines, spreads = [], []
    for name, taken in times.items():
        low, middle, high = np.percentile(taken, [25, 50, 75])
        spreads.append((high - low) / middle)
        lines.append(f"- {name}: {middle:.1f} ns, ratio {middle / base:.3g}\n")
    off = max(differences.values())
    return (
        "".join(lines)
        + f"\nQuartiles are up to {max(spreads):.0%} apart, values up to {off:.0e} on values of about one.\n"
    )


if __name__ == "__main__":
    main()
