"""Matrices of nodes with rotations, as Nastran and Abaqus write them: a bar of beam elements against closed forms."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import vpm
from vpm.errors import ReductionError
from vpm.numbers import Array
from vpm.reduction import Reduction, read_structure, reduce_structure

YOUNG, SHEAR, DENSITY = 206e9, 80e9, 7850.0
LENGTH, WIDTH, HEIGHT = 0.6, 0.012, 0.008
AREA, ABOUT_X, ABOUT_Y = WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12.0, HEIGHT * WIDTH**3 / 12.0
POLAR = ABOUT_X + ABOUT_Y
#: Torsion constant; a round number, so that the wave of torsion is not that of the whole polar moment.
TWIST = 0.4 * POLAR
#: Labels do not begin with one, and have gaps.
FIRST, GAP = 101, 7
KINDS = ("punched", "commas", "abaqus")


class Bar(NamedTuple):
    """Matrices (6 per node), places and labels."""

    stiffness: Array
    mass: Array
    nodes: Array
    labels: list[int]


def bar(elements: int, unit: float = 1.0, polar: float = POLAR) -> Bar:
    """Euler-Bernoulli elements along z with lumped mass, and rotary inertia about z alone; lengths in ``unit`` m."""
    size = 6 * (elements + 1)
    stiffness, mass, h = np.zeros((size, size)), np.zeros((size, size)), LENGTH / elements
    for at in range(elements):
        own = 6 * at + np.arange(12)
        stiffness[np.ix_(own, own)] += element(h)
        for node in own[:6], own[6:]:
            mass[node[:3], node[:3]] += DENSITY * AREA * h / 2.0
            mass[node[5], node[5]] += DENSITY * polar * h / 2.0
    scale = np.tile([1.0, 1.0, 1.0, *[1.0 / unit] * 3], elements + 1)
    nodes = np.zeros((elements + 1, 3))
    nodes[:, 2] = np.linspace(0.0, LENGTH, elements + 1)
    labels = [FIRST + GAP * at for at in range(elements + 1)]
    return Bar(scale[:, None] * stiffness * scale, scale[:, None] * mass * scale, nodes / unit, labels)


def element(h: float) -> Array:
    """Stiffness of a slender beam along z; Przemieniecki, *Theory of Matrix Structural Analysis*, 1968, section 5.6."""
    found = np.zeros((12, 12))
    for component, stiffness in ((2, YOUNG * AREA / h), (5, SHEAR * TWIST / h)):
        pair = np.ix_([component, component + 6], [component, component + 6])
        found[pair] += stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    bending = np.array(
        [[12.0, 6 * h, -12.0, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
         [-12.0, -6 * h, 12.0, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    ) / h**3  # fmt: skip
    # A slope of x along z is a rotation about y, that of y a rotation about -x.
    for shift, turn, sign, moment in ((0, 4, 1.0, ABOUT_Y), (1, 3, -1.0, ABOUT_X)):
        signs = np.array([1.0, sign, 1.0, sign])
        own = [shift, turn, shift + 6, turn + 6]
        found[np.ix_(own, own)] += YOUNG * moment * bending * np.outer(signs, signs)
    return found


def entries(matrix: Array, labels: Sequence[int]) -> list[tuple[int, int, int, int, float]]:
    """Lower triangle: node and component of column and row, and the entry."""
    return [
        (labels[column // 6], column % 6 + 1, labels[row // 6], row % 6 + 1, float(matrix[row, column]))
        for column in range(len(matrix))
        for row in range(column, len(matrix))
        if matrix[row, column] != 0.0
    ]


def punched(name: str, matrix: Array, labels: Sequence[int]) -> str:
    """DMIG cards in fields of 16 characters, as punched: a negative number touches the field before it."""
    lines = [f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}{'':16s}{len(matrix):8d}"]
    last = (0, 0)
    for node, component, row, own, entry in entries(matrix, labels):
        if (node, component) != last:
            lines.append(f"DMIG*   {name:16s}{node:16d}{component:16d}{'':16s}")
            last = node, component
        lines.append(f"*       {row:16d}{own:16d}{f'{entry:16.9E}'.replace('E', 'D')}")
    return "\n".join(lines) + "\n"


def commas(name: str, matrix: Array, labels: Sequence[int]) -> str:
    """DMIG cards between commas, two entries in each continuation; exponents without a letter."""
    lines = [f"DMIG,{name},0,6,2,0,,,{len(matrix)}"]
    columns: dict[tuple[int, int], list[str]] = {}
    for node, component, row, own, entry in entries(matrix, labels):
        number = f"{entry:.11E}".replace("E", "")
        columns.setdefault((node, component), []).append(f"{row},{own},{number},")
    for (node, component), (begin, *rest) in columns.items():
        lines.append(f"DMIG,{name},{node},{component},,{begin}")
        lines += ["," + ",".join(rest[at : at + 2]) for at in range(0, len(rest), 2)]
    return "\n".join(lines) + "\n"


def abaqus(_: str, matrix: Array, labels: Sequence[int]) -> str:
    """Lines of ``FORMAT=MATRIX INPUT``."""
    rows = [
        f"{row},{own}, {node},{component}, {entry:.15e}" for node, component, row, own, entry in entries(matrix, labels)
    ]
    return "** assembled matrix\n" + "\n".join(rows) + "\n"


WRITERS: dict[str, Callable[[str, Array, Sequence[int]], str]] = {
    "punched": punched,
    "commas": commas,
    "abaqus": abaqus,
}


def written(folder: Path, kind: str, given: Bar, more: str = "", tip: int | None = None) -> Path:
    """Files of matrices and nodes, and the file that names them; Nastran has both matrices in one."""
    write = WRITERS[kind]
    stiffness, mass = write("KAAX", given.stiffness, given.labels), write("MAAX", given.mass, given.labels)
    places = zip(given.labels, given.nodes.tolist(), strict=True)
    if kind == "abaqus":
        (folder / "K.mtx").write_text(stiffness, encoding="utf-8")
        (folder / "M.mtx").write_text(mass, encoding="utf-8")
        rows = "".join(f"{label}, {x!r}, {y!r}, {z!r}\n" for label, (x, y, z) in places)
        (folder / "nodes.inp").write_text(f"*HEADING\nbar\n*NODE, NSET=ALL\n{rows}*ELEMENT\n1,1,2\n", encoding="utf-8")
        names = 'stiffness = "K.mtx"\nmass_matrix = "M.mtx"\nnodes = "nodes.inp"\n'
    else:
        rows = "".join(f"GRID,{label},,{x!r},{y!r},{z!r}\n" for label, (x, y, z) in places)
        (folder / "bar.pch").write_text(f"$ a bar\n{rows}{stiffness}{mass}ENDDATA\n", encoding="utf-8")
        names = 'stiffness = "bar.pch"\nmass_matrix = "bar.pch"\nnodes = "bar.pch"\n'
    ends = (given.labels[0], given.labels[-1] if tip is None else tip)
    faces = "".join(
        f"[interfaces.{name}]\nnodes = [{node}]\n" for name, node in zip(("root", "tip"), ends, strict=True)
    )
    path = folder / f"{kind}.toml"
    path.write_text(f"[matrices]\n{names}{more}\n{faces}", encoding="utf-8")
    return path


def reduced(folder: Path, kind: str, elements: int, modes: int = 8) -> Reduction:
    folder.mkdir(exist_ok=True)
    return vpm.reduce(written(folder, kind, bar(elements), "mass = 0.452"), modes)


def wave(speed: float, elements: int) -> float:
    """Slowest frequency of a clamped chain of n masses, Hz: the displacement ``sin(j pi / 2 n)`` solves it exactly."""
    return float(elements * speed / LENGTH * np.sin(np.pi / (4.0 * elements)) / np.pi)


@pytest.mark.parametrize("kind", KINDS)
def test_torsion_and_tension_are_those_of_a_chain_of_masses(kind: str, tmp_path: Path) -> None:
    """To the digits of the file: rotations, their inertia and the units of both are read as they stand."""
    found = reduced(tmp_path, kind, 6, modes=14)
    torsion, along = np.sqrt(SHEAR * TWIST / (DENSITY * POLAR)), np.sqrt(YOUNG / DENSITY)
    for speed in (torsion, along):
        expected = wave(speed, 6)
        assert np.min(np.abs(found.full / expected - 1.0)) < 1e-7
        assert np.min(np.abs(found.frequencies / expected - 1.0)) < 1e-2  # of few modes
    assert found.mass == pytest.approx(DENSITY * AREA * LENGTH, rel=1e-8)


@pytest.mark.parametrize("polar", [POLAR, 0.0])
def test_bending_converges_to_that_of_a_beam_with_the_square_of_the_mesh(polar: float, tmp_path: Path) -> None:
    """The first two about each axis; S. Rao, *Mechanical Vibrations*, section 8.5: roots of 1 + cos cosh.

    Also where rotations have no inertia at all, as those of Nastran's bars.
    """
    roots = np.array([1.8751040687, 4.6940911330])
    bending = [roots**2 / LENGTH**2 * np.sqrt(YOUNG * moment / (DENSITY * AREA)) for moment in (ABOUT_X, ABOUT_Y)]
    expected = np.sort(np.concatenate(bending)) / (2.0 * np.pi)
    errors = [
        vpm.reduce(written(tmp_path, "punched", bar(n, polar=polar)), 6).frequencies[:4] / expected - 1.0
        for n in (5, 10, 20)
    ]
    for coarse, fine in pairwise(errors):
        np.testing.assert_allclose(coarse / fine, 4.0, rtol=0.15)
    assert np.abs(errors[-1]).max() < 5e-3


def test_all_formats_and_units_give_the_same_link(tmp_path: Path) -> None:
    """Cards have ten digits, of which the difference of large entries leaves seven."""
    first, *others = (reduced(tmp_path, kind, 8) for kind in KINDS)
    (tmp_path / "mm").mkdir()
    small = bar(8, unit=1e-3)
    # Newton per millimetre, tonnes.
    small = small._replace(stiffness=1e-3 * small.stiffness, mass=1e-3 * small.mass)
    others.append(vpm.reduce(written(tmp_path / "mm", "abaqus", small, 'units = "mm-t-s"'), 8))
    for other in others:
        np.testing.assert_allclose(other.frequencies, first.frequencies, rtol=1e-6)
        np.testing.assert_allclose(other.link.places, first.link.places, atol=1e-12)
        np.testing.assert_allclose(np.abs(other.link.shapes), np.abs(first.link.shapes), rtol=1e-4, atol=1e-4)


def test_point_masses_have_the_inertia_of_bodies_with_rotary_inertia(tmp_path: Path) -> None:
    """A slender bar about its axis has nothing but that; each mode has unit modal mass."""
    link = reduced(tmp_path, "abaqus", 6, modes=14).link
    about_z = float(link.masses @ (link.points[:, :2] ** 2).sum(axis=1))
    assert about_z == pytest.approx(DENSITY * POLAR * LENGTH, rel=1e-8)
    products = np.einsum("s,sik,sjk->ij", link.masses, link.point_shapes, link.point_shapes)
    np.testing.assert_allclose(products, np.eye(len(products)), atol=1e-7)


def test_a_node_with_rotations_is_its_own_average(tmp_path: Path) -> None:
    structure = read_structure(written(tmp_path, "abaqus", bar(6)))
    rigid, averaged = (
        reduce_structure(replace(structure, interfaces=tuple(replace(one, tie=tie) for one in structure.interfaces)), 6)
        for tie in ("rigid", "averaged")
    )
    np.testing.assert_allclose(averaged.frequencies, rigid.frequencies, rtol=1e-7)
    np.testing.assert_allclose(np.abs(averaged.link.shapes), np.abs(rigid.link.shapes), atol=1e-6)


def test_a_machine_carries_a_tool_on_a_node_with_rotations(tmp_path: Path) -> None:
    """A heavy point mass at the tip: Rayleigh's frequency, 3 EI / L^3 over m + 33/140 of the bar."""
    reduced(tmp_path, "punched", 20).link.save(tmp_path / "bar.npz")
    load = 20.0
    (tmp_path / "arm.toml").write_text(
        f"""
name = "arm"
gravity = [0, 0, 0]
[bodies.hub]
mass = 1.0
inertia = [0.01, 0.01, 0.01, 0, 0, 0]
[bodies.tool]
mass = {load}
[joints.slide]
type = "prismatic"
parent = "world"
child = "hub"
axis = [0, 0, 1]
[beams.bar]
parent = "hub"
reduced = "bar.npz"
level = "reduced(8)"
[joints.grip]
type = "fixed"
parent = "bar"
child = "tool"
""",
        encoding="utf-8",
    )
    arm = vpm.Model.load(tmp_path / "arm.toml")
    found = np.asarray(arm.natural_frequencies([0.0]))
    weight = load + 33.0 / 140.0 * DENSITY * AREA * LENGTH
    for moment in (ABOUT_X, ABOUT_Y):
        expected = np.sqrt(3.0 * YOUNG * moment / LENGTH**3 / weight) / (2.0 * np.pi)
        assert np.min(np.abs(found / expected - 1.0)) < 2e-3


def test_a_rotation_that_nothing_resists_is_left_out(tmp_path: Path) -> None:
    """As drilling rotations of flat shells: zero rows of components in the file change nothing."""
    given = bar(4)
    more = "".join(f"{label},{component}, {label},{component}, 0.0\n" for label in (901, 902) for component in (4, 5))
    path = written(tmp_path, "abaqus", given)
    (tmp_path / "K.mtx").write_text((tmp_path / "K.mtx").read_text(encoding="utf-8") + more, encoding="utf-8")
    assert read_structure(path).rotations.size == 15


@pytest.mark.parametrize(
    ("kind", "old", "new", "said"),
    [
        ("punched", f"KAAX    {0:8d}{6:8d}{2:8d}", f"KAAX    {0:8d}{6:8d}{4:8d}", "form 6 and type 4"),
        ("punched", f"KAAX    {0:8d}{6:8d}{2:8d}", f"KAAX    {0:8d}{9:8d}{2:8d}", "form 9 and type 2"),
        ("punched", "KAAX", "MASS", "one name has to begin with K"),
        ("punched", f"*       {101:16d}{3:16d}", f"*       {101:16d}{0:16d}", "component 0 of node 101.*modal"),
        ("punched", f"*       {101:16d}{3:16d}", f"*       {'x':>16s}{3:16d}", "KAAX cannot be read"),
        ("commas", "GRID,108,,", "GRID,108,7,", "GRID 108 has a coordinate system"),
        ("commas", "GRID,108,,", "GRID,109,,", "does not have the node 108"),
        ("commas", "GRID,108,,", "GRID,10y,,", "no list of nodes with labels"),
        ("commas", "nodes = [101]", "nodes = [102]", "interfaces.root has the node 102"),
        ("abaqus", "101,1, 101,1,", "101,7, 101,1,", "component 7 of node 101"),
        ("abaqus", "101,1, 101,1,", "101,1, 101.5,1,", "no whole numbers"),
        ("abaqus", "101,1, 101,1,", "-4,1, 101,1,", "component 1 of node -4"),
        ("abaqus", "** assembled matrix\n", "101,1, 101,1, 1e7\n", "gives an entry twice"),
        ("abaqus", "101,1, 101,1,", "101,1, stiff,1,", "is no matrix"),
    ],
)
def test_what_cannot_be_read_is_told_in_a_sentence(kind: str, old: str, new: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, kind, bar(3))
    changed = 0
    for file in tmp_path.iterdir():
        text = file.read_text(encoding="utf-8")
        changed += old in text
        file.write_text(text.replace(old, new), encoding="utf-8")
    assert changed
    with pytest.raises(ReductionError, match=said) as told:
        vpm.reduce(path, 4)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_are_refused_in_a_sentence_or_give_finite_numbers(kind: str, tmp_path: Path) -> None:
    """Bytes that are lost or exchanged, and numbers that no file should have."""
    path = written(tmp_path, kind, bar(2))
    whole = {file: file.read_bytes() for file in tmp_path.iterdir() if file != path}
    told: list[str] = []
    for seed in range(120):
        generator = np.random.default_rng(seed)
        for file, content in whole.items():
            damaged = bytearray(content)
            for _ in range(int(generator.integers(1, 4))):
                at, width = int(generator.integers(len(damaged))), int(generator.integers(30))
                inserted = generator.choice([b"", b"9e99", b"nan", b"-", b",", b"\n", b"1e400", b"9" * 20, b"\xff"])
                damaged[at : at + width] = bytes(inserted)
            file.write_bytes(bytes(damaged))
        try:
            assert np.isfinite(vpm.reduce(path, 3).frequencies).all()
        except ReductionError as error:
            told.append(str(error))
    assert len(told) > 60
    assert not [sentence for sentence in told if "\n" in sentence]


def test_consistent_mass_of_beams_is_refused(tmp_path: Path) -> None:
    """A large motion needs products of the mass with places that such a matrix does not tell."""
    given = bar(3)
    given.mass[0, 4] = given.mass[4, 0] = 0.1 * np.sqrt(given.mass[0, 0] * 1e-6)
    given.mass[4, 4] = 1e-6
    with pytest.raises(ReductionError, match=r"couples node 101, rotation about y, with node 101, x.*COUPMASS"):
        vpm.reduce(written(tmp_path, "abaqus", given), 4)


def test_a_support_left_in_the_matrices_is_told_by_its_label(tmp_path: Path) -> None:
    given = bar(3)
    given.stiffness[12:15, :] = given.stiffness[:, 12:15] = 0.0
    with pytest.raises(ReductionError, match=r"on its diagonal, at node 115, x"):
        vpm.reduce(written(tmp_path, "punched", given), 4)
    grounded = bar(3)
    grounded.stiffness[4, 4] *= 2.0
    with pytest.raises(ReductionError, match=r"resists the rotation about y"):
        vpm.reduce(written(tmp_path, "punched", grounded), 4)
