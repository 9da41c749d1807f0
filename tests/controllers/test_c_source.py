"""Models in C99: compiled with all warnings as errors, called from C, CasADi and as acados does, against the core."""

import ctypes
import re
import runpy
import shutil
import subprocess
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.linalg import expm

from command_line import ran
from nightly import at_night
from places import EXAMPLES
from test_ball_joints import FRICTION, OVER, start, top
from test_frictions import geared
from test_sides import rubbing_on_both_sides
from vpm import Model, Simulation
from vpm.errors import SimulationError, VpmError
from vpm.linear import LinearModel
from vpm.numbers import Array
from vpm.realtime import CSource, c_source

#: Levels of flexible links whose derivatives take a compiler seconds; those of the files take it a minute, or ten.
COARSE = {
    "curved_arm/model.toml": "strain(1)",
    "flexible_pendulum/flexible_pendulum.toml": "bezier(3)",
    "spinning_beam/spinning_beam.toml": "bezier(2)",
    "optimise/arm.toml": "bezier(2)",
    "reduced_link/arm.toml": "reduced(3)",
    "tudor/merit.toml": "bezier(2)",
    "tudor/tudor.toml": "bezier(3)",
}
#: Where a machine can stand, if it cannot with all joints at zero.
STANDING = {"hip_rotation.position": np.deg2rad(40.0), "knee_rotation.position": np.deg2rad(-80.0)}
POSES = {
    "hyl/hydraulic.toml": STANDING,
    "hyl/hydraulic_fcm.toml": STANDING,
    "maxwell_narx/strut.toml": {"axis.position": 0.32},
}
#: So few samples of any integrator are not worth machine code, even with derivatives.
FEW = 6
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")
WITHOUT_COMPILER = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler `cc` here")


def cc(folder: Path, *words: str, optimise: str = "-O1") -> None:
    command = ["cc", *STRICT, optimise, *words, "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class Library:
    """A machine's shared library, called with NumPy arrays."""

    def __init__(self, written: CSource, folder: Path) -> None:
        written.save(folder)
        self.name, self.path = written.name, folder / "machine.so"
        # Half the time for the largest; the others show what warns only when it is optimised.
        optimise = "-O0" if len(written.source) > 500_000 else "-O1"
        cc(folder, "-fPIC", "-shared", f"{self.name}.c", "-o", self.path.name, optimise=optimise)
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

    def call(self, name: str, *arguments: Array | float) -> int:
        def given(one: Array | float) -> object:
            return ctypes.c_double(one) if isinstance(one, float) else one.ctypes.data_as(ctypes.c_void_p)

        function = getattr(self.core, f"{self.name}_{name}")
        return int(function(*map(given, arguments)))

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


def places(model: Model, count: int = 3, pose: dict[str, float] | None = None) -> list[LinearModel]:
    """Linear models at places around rest: a hundredth of each state away, nothing symmetric."""
    rng = np.random.default_rng(5)
    rest = model.linearize(pose)
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


def near(model: Model, found: Array, expected: Array, share: float) -> None:
    """To a share of the largest coordinate, of the largest rate, and of each state of a drive."""
    n = model.core.n_coordinates
    size = np.abs(expected)
    size[:n], size[n : 2 * n] = size[:n].max(), size[n : 2 * n].max()
    assert np.all(np.abs(found - expected) <= share * size + 1e-300)


def natural_step(linear: LinearModel) -> float:
    """A tenth of the time constant of what is fastest, s, or a millisecond."""
    return float(min(1e-3, 0.1 / np.abs(np.linalg.eigvals(linear.A)).max()))


def direct(model: Model, linear: LinearModel, step: float) -> tuple[Array, Array]:
    """Outputs, and the state a Runge-Kutta step on, by the laws themselves: two samples are none that code pays for."""
    held = np.tile(linear.command, (2, 1))
    outputs, states, _ = model.core.simulate(model.theta, linear.state, held, step, 1, "rk4")
    return outputs[0], states[1]


def refusals() -> dict[str, str]:
    """Why a file cannot be written as C, by its name; scenarios, tasks and solids are no machines."""
    found = {}
    for path in sorted(EXAMPLES.glob("*/*.toml")):
        name = path.relative_to(EXAMPLES).as_posix()
        if (
            not {"scenario", "task", "solid"} & set(tomllib.loads(path.read_text(encoding="utf-8")))
            and name not in MACHINES
        ):
            with pytest.raises(VpmError) as error:
                c_source(Model.load(path))
            found[name] = str(error.value)
    return found


MACHINES = tuple(
    path.relative_to(EXAMPLES).as_posix()
    for path in sorted(EXAMPLES.glob("*/*.toml"))
    if {"bodies"} == {"bodies", "loops"} & set(tomllib.loads(path.read_text(encoding="utf-8")))
)


#: Rigid, flexible, hydraulic, with contact, on shafts: written outside of `make test-nightly`.
DAILY = {
    "arm/arm.toml",
    "flexible_pendulum/flexible_pendulum.toml",
    "hyl/rcm.toml",
    "servo_cylinder/rig.toml",
    "wrist/wrist.toml",
}
#: Machines of one compliant slide, with effects in groups that act at once.
OWN = {"both_sides": rubbing_on_both_sides, "geared": geared}


def machine(name: str) -> Model:
    """A machine of the examples, with flexible links of few coordinates, or one of these tests."""
    if name in OWN:
        return OWN[name]()
    model = Model.load(EXAMPLES / name)
    return model.at(COARSE[name]) if name in COARSE else model


def test_all_machines_of_the_examples_can_be_written() -> None:
    """What is left are linkages alone, without equations of their own, and loops, which a step has to close again."""
    sentences = refusals()
    linkages = {"hyq_leg/leg.toml", "karl/karl.toml"}
    assert {name for name, sentence in sentences.items() if "type is not a known key" in sentence} == linkages
    assert all("closed loops" in sentences[name] for name in set(sentences) - linkages)
    assert len(MACHINES) >= 16


@WITHOUT_COMPILER
@pytest.mark.parametrize("name", [*at_night(MACHINES, but=DAILY), *OWN])
def test_examples_say_the_same_in_c(name: str, tmp_path: Path) -> None:
    model = machine(name)
    written = c_source(model, name="m")
    assert written.parameters == ()
    library = Library(written, tmp_path)
    for linear in places(model, pose=POSES.get(name)):
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
        step = natural_step(linear)
        seen, expected = direct(model, linear, step)
        np.testing.assert_allclose(outputs, seen, rtol=1e-12, atol=1e-12 * np.abs(seen).max())
        found = np.zeros_like(rates)
        library.call("step_rk4", *point, step, library.work, found)
        # Beside the rates' own digits, the rounding of a sum to the size of the state.
        bound = 1e-12 * np.abs(expected - linear.state).max() + 4e-16 * np.abs(linear.state)
        assert np.all(np.abs(found - expected) <= bound)
        sim = Simulation(model, step, integrator="rosenbrock", state=linear.state)
        found = linear.state.copy()
        for _ in range(3):
            sim.step(linear.command)
            library.call("step_rosenbrock", found, linear.command, library.constants(), step, library.work, found)
        # Solutions of linear systems that hold pascals beside metres lose some digits to rounding in another order.
        near(model, found, sim.state, 1e-9)


@pytest.mark.filterwarnings("ignore::vpm.errors.ValidityWarning")  # modes at random are far beyond small deflections
@pytest.mark.parametrize("name", [*at_night(MACHINES, but=DAILY), *OWN])
def test_examples_say_the_same_as_machine_code_and_recorded(name: str) -> None:
    """The laws themselves against machine code, and against their record evaluated in numbers with derivatives."""
    model = machine(name)
    linear = places(model, 1, POSES.get(name))[0]
    held, step = np.tile(linear.command, (20, 1)), natural_step(linear)
    for integrator in ("rk4", "linearly_implicit", "rosenbrock", "additive"):
        given = (model.theta, linear.state, held, step, 1, integrator)
        outputs, states, _ = model.core.simulate(*given)
        _, their_states, _ = model.core.simulate(*given, [0])
        recorded, _, _ = model.core.simulate(model.theta, linear.state, held[:FEW], step, 1, integrator, [0])
        compiled = Simulation(model, step, integrator=integrator, state=linear.state, compiled=True)
        assert compiled.not_compiled is None
        compiled.run(held[:-1])
        for found in (their_states[-1], compiled.state):
            # Solutions of linear systems that hold pascals beside metres lose some digits to rounding in another order.
            near(model, found, states[-1], 1e-11 if integrator == "rk4" else 1e-9)
        close(recorded, outputs[:FEW])


@WITHOUT_COMPILER
def test_free_parameters_are_prepared_and_differentiated(tmp_path: Path) -> None:
    model = Model.load(EXAMPLES / "arm" / "arm.toml")
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
    words = ["compile", str(EXAMPLES / "emps" / "model.toml"), "--name", "axis", "--parameter", "*.mass"]
    done = ran(*words, "--c", str(tmp_path / "axis"))
    written = c_source(emps, name="axis", parameters=["*.mass"])
    assert (tmp_path / "axis" / "axis.h").read_text(encoding="utf-8") == written.header
    assert (tmp_path / "axis" / "axis.c").read_text(encoding="utf-8") == written.source
    assert all(name in done.stdout for name in written.parameters)


@WITHOUT_COMPILER
def test_the_loop_of_the_examples_ends_where_a_simulation_does(emps: Model, tmp_path: Path) -> None:
    c_source(emps, name="axis").save(tmp_path)
    cc(tmp_path, "-I.", str(EXAMPLES / "c" / "equations_loop.c"), "axis.c", "-o", "loop")
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
    model = Model.load(EXAMPLES / "arm" / "arm.toml")
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


@WITHOUT_COMPILER
def test_casadi_moves_an_axis_by_its_equations(tmp_path: Path, casadi: ModuleType, emps: Model) -> None:
    assert casadi.__name__ == "casadi"
    example = runpy.run_path(str(EXAMPLES / "c" / "casadi_motion.py"))
    f = example["rates"](tmp_path)
    # A step of the implicit midpoint rule: Newton's method on exact Jacobians ends in one step: this axis is linear.
    h = 0.05
    x0, u, x1 = casadi.MX.sym("x0", 2), casadi.MX.sym("u"), casadi.MX.sym("x1", 2)
    gap = {"x": x1, "p": casadi.vertcat(x0, u), "g": x1 - x0 - h * f(0.5 * (x0 + x1), u)}
    step = casadi.rootfinder("step", "newton", gap, {"max_iter": 2})
    linear = emps.linearize()
    begin, command = np.array([0.01, 0.2]), np.array([0.7])
    left, right = np.eye(2) - 0.5 * h * linear.A, np.eye(2) + 0.5 * h * linear.A
    expected = np.linalg.solve(left, right @ begin + h * linear.B @ command)
    found = np.array(step(begin, [*begin, *command])).ravel()
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    # The cheapest commands that move a mass with viscous friction, solved for by linear algebra alone.
    states, commands = example["motion"](f)
    steps, h = example["STEPS"], example["DURATION"] / example["STEPS"]
    left, right = np.eye(2) - 0.5 * h * linear.A, np.eye(2) + 0.5 * h * linear.A
    A, B = np.linalg.solve(left, right), np.linalg.solve(left, h * linear.B)
    reach = np.hstack([np.linalg.matrix_power(A, steps - 1 - k) @ B for k in range(steps)])
    cheapest = np.linalg.lstsq(reach, np.array([example["WAY"], 0.0]), rcond=None)[0]
    np.testing.assert_allclose(states[-1], [example["WAY"], 0.0], atol=1e-9)
    np.testing.assert_allclose(commands.ravel(), cheapest, atol=1e-4 * np.abs(cheapest).max())
    sim = Simulation(emps, h)
    sim.run(commands)
    # Between the midpoint rule and the axis itself lies a ten-thousandth of the way.
    assert sim["axis.position"] == pytest.approx(example["WAY"], rel=1e-4)


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
    model = Model.load(EXAMPLES / "arm" / "arm.toml")
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


@WITHOUT_COMPILER
def test_acados_steps_implicitly_with_exact_jacobians(tmp_path: Path, emps: Model) -> None:
    """By functions of (x, dx/dt, u, z, t, p): on a linear axis a Padé approximant of the exponential."""
    c_source(emps, name="axis").save(tmp_path)
    sources = [str(EXAMPLES / "c" / name) for name in ("acados_step.c", "acados_functions.c")]
    cc(tmp_path, "-I.", "-Dcasadi_int=int", *sources, "axis.c", "-o", "step")
    linear, h = emps.linearize(), 5e-3
    begin, command = np.array([0.01, 0.1]), np.array([0.5])
    words = [repr(float(number)) for number in (*begin, *command, h)]
    done = subprocess.run([tmp_path / "step", *words], capture_output=True, text=True, check=True)
    after, Sx, Su = np.split(np.array([float(line) for line in done.stdout.split()]), [2, 6])
    Z, one = h * np.block([[linear.A, linear.B], [np.zeros((1, 3))]]), np.eye(3)
    step = np.linalg.solve(one - Z / 2 + Z @ Z / 12, one + Z / 2 + Z @ Z / 12)
    # Hairer & Wanner 1996, table IV.3.1: it leaves Z^5 / 720 of the exponential.
    assert np.abs(step - expm(Z)).max() < 2.0 * np.abs(np.linalg.matrix_power(Z, 5)).max() / 720.0
    np.testing.assert_allclose(after, step[:2] @ np.concatenate([begin, command]), rtol=1e-12)
    np.testing.assert_allclose(Sx.reshape(2, 2).T, step[:2, :2], rtol=1e-12)
    np.testing.assert_allclose(Su, step[:2, 2], rtol=1e-12)
    complaint = subprocess.run([tmp_path / "step"], capture_output=True, text=True, check=False)
    assert complaint.returncode == 1
    assert "give 2 states, 1 inputs" in complaint.stderr


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


#: What the functions return: all is well, and the angles of a ball joint are no coordinates there.
OK, NO_ANGLES = 0, 2


@WITHOUT_COMPILER
def test_rates_of_a_ball_joint_at_its_singularity_are_no_numbers_and_the_status_says_so(tmp_path: Path) -> None:
    model = top()
    written = c_source(model, name="m")
    library = Library(written, tmp_path)
    for angle in (0.3, np.pi / 2 - 1e-3, np.pi / 2 - 1e-5, np.pi / 2):
        state, rates, outputs = np.array([0.1, angle, 0.2, 1.0, 2.0, 3.0]), np.zeros(6), np.zeros(len(model.channels))
        point = (state, np.zeros(1), library.constants(), library.work)
        expected = OK if angle < np.pi / 2 - 1e-4 else NO_ANGLES
        assert library.call("evaluate_rates", *point, rates) == expected
        assert np.isfinite(rates).all() == (expected == OK)
        assert np.isnan(rates).all() == (expected == NO_ANGLES)
        assert library.call("evaluate_outputs", *point, outputs) == expected
        # What follows from angles and rates alone is right everywhere.
        names = list(model.output_channels)
        turning = [outputs[names.index(f"ball.{axis}")] for axis in ("wx", "wy", "wz")]
        sb, cb, sc, cc = np.sin(angle), np.cos(angle), np.sin(0.2), np.cos(0.2)
        np.testing.assert_allclose(turning, [cb * cc + 2.0 * sc, 2.0 * cc - cb * sc, sb + 3.0], rtol=1e-13)
    assert "NAME" not in written.header + written.source


THROWN = {
    "name": "thrown",
    "gravity": [0.0, 0.0, -9.81],
    "bodies": {
        "body": {"mass": 2.0, "center_of_mass": [0.1, 0.2, 0.3], "inertia": [1.0, 2.0, 2.5, 0.0, 0.0, 0.0]},
        "arm": {"mass": 0.5, "center_of_mass": [0.0, 0.0, 0.2], "inertia": [0.02, 0.03, 0.01, 0.0, 0.0, 0.0]},
    },
    "joints": {
        "ball": {"type": "free", "parent": "world", "child": "body"},
        "elbow": {"type": "revolute", "parent": "body", "child": "arm", "axis": [0.0, 1.0, 0.0]},
    },
    "actuators": {"motor": {"joint": "elbow", "gain": 1.0}},
}


@WITHOUT_COMPILER
@pytest.mark.parametrize("method", ["rk4", "rosenbrock"])
def test_bodies_tumble_in_c_as_in_the_core(method: str, tmp_path: Path) -> None:
    """One past the singularity of its angles again and again, with an arm that a motor moves; one right through it."""
    begun = start(np.array([0.2, 1.4, -0.4]), np.array([1.0, 5.0, 0.5]))
    thrown = {name.replace("ball_", "ball_r"): value for name, value in begun.items()}
    for model, first, angle in ((Model.from_dict(THROWN), thrown, "ball_ry"), (top(), OVER, "ball_y")):
        written = c_source(model, name="m", parameters=["body.mass"])
        library = Library(written, tmp_path / angle)
        assert not re.search(r"\b(malloc|calloc|realloc|free|alloca)\s*\(", written.source)
        place, step, command = model.state_names.index(f"{angle}.position"), 2e-3, np.full(len(model.inputs), 0.1)
        sim, found = Simulation(model, step, integrator=method, state=first), model.state(first)
        cosines = []
        for _ in range(2000):
            before = found.copy()
            point = (before, command, library.constants(), step, library.work)
            assert library.call(f"step_{method}", *point, found) == OK
            sim.step(command)
            near(model, found, sim.state, 1e-10)
            cosines.append(np.cos(found[place]))
        assert np.count_nonzero(np.abs(cosines) < 0.05) > 20
        assert (min(cosines) < 0.0) == (angle == "ball_y")
        # The next state may take the place of the last.
        library.call(f"step_{method}", *point, before)
        np.testing.assert_array_equal(before, found)


@WITHOUT_COMPILER
@pytest.mark.parametrize("method", ["rk4", "rosenbrock"])
def test_steps_that_need_an_angle_are_right_or_say_that_they_are_not(method: str, tmp_path: Path) -> None:
    model = top(effects=[FRICTION])
    library = Library(c_source(model, name="m"), tmp_path)
    sim, found, ended = Simulation(model, 1e-3, integrator=method, state=OVER), model.state(OVER), ""
    while not ended:
        before = found.copy()
        status = library.call(f"step_{method}", before, np.zeros(1), library.constants(), 1e-3, library.work, found)
        try:
            sim.step()
        except VpmError as error:
            ended = str(error)
        else:
            assert status == OK
            near(model, found, sim.state, 1e-10)
    assert "comes too near to the singularity" in ended
    assert status == NO_ANGLES
    np.testing.assert_array_equal(found, before)
    # A step over the singularity is none, however far beyond it ends.
    assert (
        library.call(f"step_{method}", before, np.zeros(1), library.constants(), 0.5, library.work, found) == NO_ANGLES
    )


@WITHOUT_COMPILER
def test_a_step_that_turns_a_joint_too_far_says_so(tmp_path: Path) -> None:
    library = Library(c_source(top(), name="m"), tmp_path)
    state = top().state({"ball_y.velocity": 100.0})
    for step, status in ((9e-3, OK), (1.1e-2, NO_ANGLES)):
        found = state.copy()
        assert library.call("step_rk4", state, np.zeros(1), library.constants(), step, library.work, found) == status
        assert np.array_equal(found, state) == (status != OK)


@WITHOUT_COMPILER
def test_casadi_functions_of_a_ball_joint_fail_at_its_singularity(tmp_path: Path, casadi: ModuleType) -> None:
    library = Library(c_source(top(), name="m"), tmp_path)
    rates = casadi.external("m_rates", str(library.path))
    state = np.array([0.1, 0.3, 0.2, 1.0, 2.0, 3.0])
    assert np.isfinite(np.array(rates(state, []))).all()
    state[1] = np.pi / 2
    with pytest.raises(RuntimeError):
        rates(state, [])
