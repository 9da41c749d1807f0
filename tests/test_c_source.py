"""Models in C99: compiled with all warnings as errors, called from C, CasADi and as acados does, against the core."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from vpm import Model, Simulation
from vpm.cli import app
from vpm.errors import SimulationError
from vpm.linear import LinearModel
from vpm.realtime import CSource, c_source

ROOT = Path(__file__).parent.parent
Array = NDArray[np.float64]
MACHINES = {
    "axis": "emps/model.toml",
    "arm": "arm/arm.toml",
    "flexible": "flexible_pendulum/flexible_pendulum.toml",
    "cylinder": "servo_cylinder/rig.toml",
    "crane": "crane/crane.toml",
}
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1")
WITHOUT_COMPILER = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler `cc` here")


def cc(folder: Path, *words: str) -> None:
    done = subprocess.run(["cc", *STRICT, *words, "-lm"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class Library:
    """A machine's shared library, called with NumPy arrays."""

    def __init__(self, written: CSource, folder: Path) -> None:
        written.save(folder)
        self.name, self.path = written.name, folder / "machine.so"
        cc(folder, "-fPIC", "-shared", f"{self.name}.c", "-o", self.path.name)
        self.core = ctypes.CDLL(str(self.path))
        self.sizes = {what: int(size) for what, size in re.findall(rf"{self.name}_(N\w+) = (\d+)", written.header)}
        self.work = np.zeros(self.sizes["NW"])

    def numbers(self, name: str, count: int) -> Array:
        return np.array((ctypes.c_double * count).in_dll(self.core, f"{self.name}_{name}"))

    def constants(self) -> Array:
        return self.numbers("constants", max(1, self.sizes["NC"]))

    def pattern(self, name: str) -> tuple[int, int, Array, Array]:
        head = (ctypes.c_longlong * 2).in_dll(self.core, f"{self.name}_{name}")
        rows, columns = head[0], head[1]
        first = np.array((ctypes.c_longlong * (3 + columns)).in_dll(self.core, f"{self.name}_{name}"))[2:]
        whole = np.array((ctypes.c_longlong * (3 + columns + first[-1])).in_dll(self.core, f"{self.name}_{name}"))
        return rows, columns, first, whole[3 + columns :]

    def call(self, name: str, *arguments: Array | float) -> None:
        def given(one: Array | float) -> object:
            return ctypes.c_double(one) if isinstance(one, float) else one.ctypes.data_as(ctypes.c_void_p)

        function = getattr(self.core, f"{self.name}_{name}")
        function(*map(given, arguments))

    def full(self, name: str, entries: Array) -> Array:
        rows, columns, first, row = self.pattern(name)
        matrix = np.zeros((rows, columns))
        for j in range(columns):
            for k in range(first[j], first[j + 1]):
                matrix[row[k], j] = entries[k]
        return matrix

    def matrices(self, what: str, size: int, point: tuple[Array, Array, Array]) -> tuple[Array, Array, Array, Array]:
        """Values and their derivatives by x, u and p."""
        values, kinds = np.zeros(size), "xup"
        entries = [np.zeros(max(1, self.pattern(f"{what}_by_{kind}")[2][-1])) for kind in kinds]
        self.call(f"evaluate_{what}_jacobian", *point, self.work, values, *entries)
        x, u, p = (self.full(f"{what}_by_{kind}", own) for kind, own in zip(kinds, entries, strict=True))
        return values, x, u, p


def places(model: Model, count: int = 3) -> list[LinearModel]:
    """Linear models at places around rest: a hundredth of each state away, nothing symmetric."""
    rng = np.random.default_rng(5)
    rest = model.linearize()
    found = []
    for _ in range(count):
        state = rest.state + 0.01 * np.maximum(np.abs(rest.state), 1.0) * rng.uniform(-1.0, 1.0, rest.state.size)
        command = rest.command + 0.1 * rng.uniform(-1.0, 1.0, rest.command.size)
        found.append(model.linearize(state, command))
    return found


def close(found: Array, expected: Array) -> None:
    """To twelve digits of the largest entry of a row: what products in another order round differently."""
    size = np.abs(expected).max(axis=-1, keepdims=True, initial=1e-300)
    np.testing.assert_allclose(found / size, expected / size, rtol=0.0, atol=1e-12)


@WITHOUT_COMPILER
@pytest.mark.parametrize("machine", MACHINES)
def test_examples_say_the_same_in_c(machine: str, tmp_path: Path) -> None:
    model = Model.load(ROOT / "examples" / MACHINES[machine])
    if model.beams:
        # Derivatives of finer links take a compiler minutes.
        model = model.at("bezier(3)")
    written = c_source(model, name="m")
    assert written.parameters == ()
    library = Library(written, tmp_path)
    for linear in places(model):
        point = (linear.state, linear.command, library.constants())
        rates, A, B, _ = library.matrices("rates", linear.state.size, point)
        outputs, C, D, _ = library.matrices("outputs", len(linear.outputs), point)
        for found, expected in [(A, linear.A), (B, linear.B), (C, linear.C), (D, linear.D)]:
            close(found, expected)
        alone = np.zeros_like(rates)
        library.call("evaluate_rates", *point, library.work, alone)
        close(alone, rates)
        alone = np.zeros_like(outputs)
        library.call("evaluate_outputs", *point, library.work, alone)
        close(alone, outputs)


@WITHOUT_COMPILER
@pytest.mark.parametrize(("machine", "step"), [("arm", 1e-3), ("cylinder", 1e-5)])
def test_steps_are_those_of_the_integrators(machine: str, step: float, tmp_path: Path) -> None:
    model = Model.load(ROOT / "examples" / MACHINES[machine])
    library = Library(c_source(model, name="m"), tmp_path)
    linear = places(model, 1)[0]
    for name in ("rk4", "rosenbrock"):
        sim = Simulation(model, step, integrator=name, state=linear.state)
        x = linear.state.copy()
        for _ in range(5):
            sim.step(linear.command)
            library.call(f"step_{name}", x, linear.command, library.constants(), step, library.work, x)
        np.testing.assert_allclose(x, sim.state, rtol=1e-11, atol=1e-12)


@WITHOUT_COMPILER
def test_free_parameters_are_prepared_and_differentiated(tmp_path: Path) -> None:
    model = Model.load(ROOT / "examples" / "arm" / "arm.toml")
    written = c_source(model, name="m", parameters=["*.mass", "*viscous*"])
    assert len(written.parameters) > 1
    library = Library(written, tmp_path)
    own = np.array([model.parameters[name].value for name in written.parameters])
    np.testing.assert_array_equal(library.numbers("parameters", own.size), own)
    other = own * 1.1
    moved = model.with_parameters(dict(zip(written.parameters, other, strict=True)))
    constants = np.zeros(library.sizes["NC"])
    library.call("prepare", other, library.work, constants)
    linear = places(moved, 1)[0]
    rates, A, _, by_p = library.matrices("rates", linear.state.size, (linear.state, linear.command, constants))
    close(A, linear.A)
    for column in range(own.size):
        # Differences of second order: steps of 1e-4 leave 1e-8, and rounding 1e-12.
        sides = []
        for sign in (1.0, -1.0):
            p = other.copy()
            p[column] *= 1.0 + 1e-4 * sign
            library.call("prepare", p, library.work, constants)
            side = np.zeros_like(rates)
            library.call("evaluate_rates", linear.state, linear.command, constants, library.work, side)
            sides.append(side)
        quotient = (sides[0] - sides[1]) / (2e-4 * other[column])
        np.testing.assert_allclose(by_p[:, column], quotient, rtol=1e-6, atol=1e-6 * np.abs(rates).max())


def test_the_command_writes_what_the_function_gives(emps: Model, tmp_path: Path) -> None:
    words = ["compile", str(ROOT / "examples" / "emps" / "model.toml"), "--name", "axis", "--parameter", "*.mass"]
    done = CliRunner().invoke(app, [*words, "--c", str(tmp_path / "axis")])
    assert done.exit_code == 0, done.output
    written = c_source(emps, name="axis", parameters=["*.mass"])
    assert (tmp_path / "axis" / "axis.h").read_text(encoding="utf-8") == written.header
    assert (tmp_path / "axis" / "axis.c").read_text(encoding="utf-8") == written.source
    assert all(name in done.output for name in written.parameters)


@WITHOUT_COMPILER
def test_the_loop_of_the_examples_ends_where_a_simulation_does(emps: Model, tmp_path: Path) -> None:
    c_source(emps, name="axis").save(tmp_path)
    cc(tmp_path, "-I.", str(ROOT / "examples" / "c" / "equations_loop.c"), "axis.c", "-o", "loop")
    done = subprocess.run([tmp_path / "loop"], capture_output=True, text=True, check=True)
    name, position = done.stdout.split()
    sim = Simulation(emps, 1e-3, integrator="rosenbrock")
    for _ in range(1000):
        sim.step(80.0 * (0.01 - sim["axis.position"]) - 12.0 * sim["axis.velocity"])
    assert name == "axis.position"
    # A thousand steps, each rounded in another order.
    assert float(position) == pytest.approx(sim["axis.position"], rel=1e-9)


@pytest.fixture
def casadi() -> ModuleType:
    module: ModuleType = pytest.importorskip("casadi", reason="CasADi is not installed (pip install casadi)")
    return module


@WITHOUT_COMPILER
@pytest.mark.parametrize("parameters", [(), ("*.mass",)])
def test_casadi_takes_functions_and_their_exact_jacobians(
    parameters: tuple[str, ...], tmp_path: Path, casadi: ModuleType
) -> None:
    model = Model.load(ROOT / "examples" / "arm" / "arm.toml")
    written = c_source(model, name="m", parameters=parameters)
    library = Library(written, tmp_path)
    linear = places(model, 1)[0]
    p = [[model.parameters[name].value for name in written.parameters]] if parameters else []
    for name, values, matrices in [("rates", "dx", (linear.A, linear.B)), ("outputs", "y", (linear.C, linear.D))]:
        function = casadi.external(f"m_{name}", str(library.path))
        assert function.name_in() == ["x", "u", "p"][: 2 + bool(parameters)]
        assert function.name_out() == [values]
        found = np.array(function(linear.state, linear.command, *p)).ravel()
        alone = np.zeros(found.size)
        library.call(f"evaluate_{name}", linear.state, linear.command, library.constants(), library.work, alone)
        close(found, alone)
        symbols = [casadi.MX.sym(one, function.size1_in(one)) for one in function.name_in()]
        expression = function(*symbols)
        for symbol, expected in zip(symbols[:2], matrices, strict=True):
            slope = casadi.Function("slope", symbols, [casadi.jacobian(expression, symbol)])
            close(np.array(slope(linear.state, linear.command, *p).full()), expected)


ACADOS = r"""
#include <stddef.h>
#include <stdio.h>
/* As acados declares the functions of a model and keeps them. */
#define DECLARED(f) \
    int f(const double **, double **, int *, double *, void *); int f##_work(int *, int *, int *, int *); \
    const int *f##_sparsity_in(int); const int *f##_sparsity_out(int); int f##_n_in(void); int f##_n_out(void);
DECLARED(m_rates)
DECLARED(m_expl_vde_forw)
DECLARED(m_expl_vde_adj)
typedef struct {
    int (*casadi_fun)(const double **, double **, int *, double *, void *);
    int (*casadi_work)(int *, int *, int *, int *);
    const int *(*casadi_sparsity_in)(int);
    const int *(*casadi_sparsity_out)(int);
    int (*casadi_n_in)(void);
    int (*casadi_n_out)(void);
} external_function_casadi;
#define KEPT(f) {f, f##_work, f##_sparsity_in, f##_sparsity_out, f##_n_in, f##_n_out}
static external_function_casadi functions[3] = {KEPT(m_rates), KEPT(m_expl_vde_forw), KEPT(m_expl_vde_adj)};
static double memory[12][10000], w[1000000];
int main(void)
{
    int f, i, k, args, results, iw, size;
    for (f = 0; f < 3; ++f) {
        const double *arg[6];
        double *res[6];
        external_function_casadi *own = functions + f;
        if (own->casadi_work(&args, &results, &iw, &size) != 0 || size > 1000000) return 1;
        for (i = 0; i < own->casadi_n_in(); ++i) {
            const int *pattern = own->casadi_sparsity_in(i);
            for (k = 0; k < pattern[0] * pattern[1]; ++k) if (scanf("%lf", memory[i] + k) != 1) return 2;
            arg[i] = memory[i];
        }
        for (i = 0; i < own->casadi_n_out(); ++i) res[i] = memory[6 + i];
        if (own->casadi_fun(arg, res, NULL, w, NULL) != 0) return 3;
        for (i = 0; i < own->casadi_n_out(); ++i) {
            const int *pattern = own->casadi_sparsity_out(i);
            for (k = 0; k < pattern[0] * pattern[1]; ++k) printf("%.17g\n", res[i][k]);
        }
    }
    return 0;
}
"""


@WITHOUT_COMPILER
def test_acados_finds_its_functions(tmp_path: Path) -> None:
    model = Model.load(ROOT / "examples" / "arm" / "arm.toml")
    c_source(model, name="m").save(tmp_path)
    (tmp_path / "acados.c").write_text(ACADOS, encoding="utf-8")
    cc(tmp_path, "-Dcasadi_int=int", "acados.c", "m.c", "-o", "acados")
    linear = places(model, 1)[0]
    rng = np.random.default_rng(2)
    nx, nu = linear.B.shape
    Sx, Su, adjoint = rng.normal(size=(nx, nx)), rng.normal(size=(nx, nu)), rng.normal(size=nx)
    x, u = linear.state, linear.command
    parts = (x, u, x, Sx.T, Su.T, u, x, adjoint, u)
    given: list[Array] = [np.asarray(part, dtype=float).ravel() for part in parts]
    text = "\n".join(float(value).hex() for value in np.concatenate(given))
    done = subprocess.run([tmp_path / "acados"], input=text, capture_output=True, text=True, check=True)
    found = np.array([float(line) for line in done.stdout.split()])
    rates, again, dSx, dSu, back = np.split(found, np.cumsum([nx, nx, nx * nx, nx * nu]))
    np.testing.assert_array_equal(rates, again)
    size = np.abs(linear.A).max()
    np.testing.assert_allclose(dSx.reshape(nx, nx).T, linear.A @ Sx, rtol=1e-11, atol=1e-11 * size)
    np.testing.assert_allclose(dSu.reshape(nu, nx).T, linear.A @ Su + linear.B, rtol=1e-11, atol=1e-11 * size)
    expected = np.concatenate([adjoint @ linear.A, adjoint @ linear.B])
    np.testing.assert_allclose(back, expected, rtol=1e-11, atol=1e-11 * size)


def refused(work: Callable[[], object]) -> str:
    with pytest.raises(SimulationError) as error:
        work()
    return str(error.value)


def test_what_cannot_be_is_refused_in_one_sentence(emps: Model) -> None:
    assert "is no name for functions of C" in refused(lambda: c_source(emps, name="2 axes"))
    assert "has no parameter `axis.masss`; " in refused(lambda: c_source(emps, parameters=["axis.masss"]))
    lagged = {
        "type": "narx",
        "joint": "axis",
        "sample_time": 1e-3,
        "inputs": {"u": "valve.command"},
        "terms": {"u[k]": 1.5},
    }
    sampled = Model.from_dict(
        {
            "name": "carriage",
            "gravity": [0.0, 0.0, -9.81],
            "bodies": {"carriage": {"mass": 8.0}},
            "joints": {"axis": {"type": "prismatic", "parent": "world", "child": "carriage", "axis": [1.0, 0.0, 0.0]}},
            "actuators": {"valve": lagged},
        }
    )
    assert "no rates in continuous time" in refused(lambda: c_source(sampled))
