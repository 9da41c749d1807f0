"""Reduced solids: against an independent assembly, the whole solid, beams, conservation laws, and what is refused."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

import vpm
from brick import bar_archive, bricks, write_archive
from runge_kutta import ahead
from vpm.errors import ModelError, ReductionError
from vpm.model.beams.reduced import ReducedLink
from vpm.numbers import Array
from vpm.reduction import Interface, Reduction, Structure, read_structure, reduce_structure
from vpm.reduction.structure import rigid_motions

STEEL = {"young": 206e9, "poisson": 0.0, "density": 7850.0}
SIZE = (0.02, 0.01, 0.4)
MODES = 6


def ends(nodes: Array, tie: Any = "rigid") -> tuple[Interface, ...]:
    """The faces at both ends of the bar; the root is held rigidly."""
    faces = {name: np.flatnonzero(np.abs(nodes[:, 2] - at) < 1e-9) for name, at in (("root", 0.0), ("tip", SIZE[2]))}
    return Interface("root", faces["root"]), Interface("tip", faces["tip"], tie)


@cache
def bar(elements: int = 6, tie: str = "rigid") -> Structure:
    """The bar by scikit-fem; without Poisson's ratio its clamp is that of a beam."""
    pytest.importorskip("skfem", reason="solids need scikit-fem")
    from vpm.reduction import box_mesh, solid

    return solid(box_mesh(SIZE, (1, 1, elements)), lambda nodes: ends(nodes, tie), **STEEL)


@cache
def reduced(elements: int = 6, tie: str = "rigid", modes: int = MODES) -> Reduction:
    return reduce_structure(bar(elements, tie), modes)


@cache
def witness() -> Structure:
    """The same by loops."""
    k, m, nodes = bricks(SIZE, (1, 1, 6), STEEL["young"], STEEL["poisson"], STEEL["density"])
    return Structure(k, m, nodes, ends(nodes))


def machine(
    link: dict[str, Any], gravity: tuple[float, float, float] = (0.0, 0.0, 0.0), load: float = 0.3
) -> vpm.Model:
    """A hub that turns about y and slides along x, with a link along z and a load on its tip."""
    body = {"mass": 0.5, "inertia": [1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0]}
    return vpm.Model.from_dict(
        {
            "name": "arm",
            "gravity": list(gravity),
            "bodies": {"cart": body, "hub": body, "load": {"mass": load, "inertia": [1e-5, 1e-5, 1e-5, 0.0, 0.0, 0.0]}},
            "joints": {
                "slide": {"type": "prismatic", "parent": "world", "child": "cart", "axis": [1.0, 0.0, 0.0]},
                "turn": {"type": "revolute", "parent": "cart", "child": "hub", "axis": [0.0, 1.0, 0.0]},
                "flange": {"type": "fixed", "parent": "link", "child": "load"},
            },
            "beams": {"link": {"parent": "hub", **link}},
        }
    )


def as_solid(reduction: Reduction, level: str | None = None) -> dict[str, Any]:
    return {"reduced": reduction.link.text, "level": level or f"reduced({reduction.frequencies.size})"}


def as_beam(level: str = "deflection(8)") -> dict[str, Any]:
    section = {"shape": "rectangle", "width": SIZE[0], "height": SIZE[1]}
    deforms = ["bending_x", "bending_y", "shear_x", "shear_y"]
    return {"length": SIZE[2], "level": level, "deforms": deforms, "material": dict(STEEL), "section": section}


def test_two_assemblies_of_a_bar_give_the_same_modes() -> None:
    one, other = reduced(), reduce_structure(witness(), MODES)
    np.testing.assert_allclose(one.frequencies, other.frequencies, rtol=1e-7)
    np.testing.assert_allclose(one.effective_mass, other.effective_mass, atol=1e-7)
    assert one.mass == pytest.approx(STEEL["density"] * np.prod(SIZE), rel=1e-12)
    assert one.link.stiffens
    assert not other.link.stiffens
    assert "stiffening" in str(other)
    assert "stiffening" not in str(one)


def test_modes_of_the_basis_are_above_those_of_the_whole_solid() -> None:
    """By Rayleigh's principle; those of the slowest half of the basis are close."""
    errors = reduced().errors
    assert errors.min() > -1e-7
    assert errors[:3].max() < 1e-3


def test_frequencies_of_a_slender_bar_converge_to_those_of_a_beam() -> None:
    expected = machine(as_beam(), load=1e-6).natural_frequencies([0.0, 0.0])[:2]
    found = [machine(as_solid(reduced(n)), load=1e-6).natural_frequencies([0.0, 0.0])[:2] for n in (3, 6, 12)]
    coarse, middle, fine = (np.abs(each / expected - 1.0).max() for each in found)
    assert middle < 0.25 * coarse
    assert fine < 0.25 * middle
    assert fine < 1e-3


def test_point_masses_have_the_kinetic_energy_of_the_solid_in_any_motion() -> None:
    structure, link = witness(), reduce_structure(witness(), MODES).link
    random = np.random.default_rng(1)
    q, rate, speed, turn = (
        random.normal(size=MODES),
        random.normal(size=MODES),
        random.normal(size=3),
        random.normal(size=3),
    )
    q *= 1e-2
    # The modes of all nodes, again: the fields of the link are those of its point masses alone.
    from vpm.reduction.craig_bampton import _own_modes
    from vpm.reduction.tied import Tied

    tied = Tied(structure)
    basis = np.hstack([tied.constraint_modes(), tied.fixed_modes(MODES)])
    shapes = tied.nodal(_own_modes(tied, basis, MODES)[1]).reshape(-1, 3, MODES)

    def velocity(places: Array, fields: Array) -> Array:
        return speed + np.cross(turn, places + fields @ q) + fields @ rate

    v = velocity(structure.nodes, shapes).ravel()
    own = velocity(link.points, link.point_shapes.transpose(0, 2, 1))
    exact, found = 0.5 * v @ (structure.mass @ v), 0.5 * np.einsum("s,sk,sk", link.masses, own, own)
    assert found == pytest.approx(exact, rel=1e-9)
    momentum = rigid_motions(structure.nodes + shapes @ q).T @ (structure.mass @ v)
    moved = link.points + np.einsum("snk,n->sk", link.point_shapes, q)
    found = rigid_motions(moved).T @ (np.repeat(link.masses, 3) * own.ravel())
    np.testing.assert_allclose(found, momentum, rtol=1e-8, atol=1e-10)


def test_rigid_solids_and_beams_have_the_same_mass_matrix() -> None:
    turned = [0.3, 0.7]
    solid, beam = machine(as_solid(reduced(), "rigid")), machine(as_beam("rigid"))
    np.testing.assert_allclose(solid.mass_matrix(turned), beam.mass_matrix(turned), rtol=1e-9)
    flexible = machine(as_solid(reduced()))
    at_rest = flexible.mass_matrix([*turned, *np.zeros(MODES)])
    np.testing.assert_allclose(at_rest[:2, :2], beam.mass_matrix(turned), rtol=1e-9)


def test_sag_is_that_of_the_beam() -> None:
    across = (9.81, 0.0, 0.0)
    models = machine(as_solid(reduced(12, modes=12)), across), machine(as_beam(), across)
    places = []
    for model in models:
        marked = vpm.Model.from_dict({**model.to_dict(), "markers": {"tip": {"parent": "link"}}})
        coordinates, _ = marked.equilibrium([0.0, 0.0])
        places.append(marked.forward_kinematics("tip", coordinates)[:3, 3])
    assert places[1][0] > 5e-5
    np.testing.assert_allclose(places[0], places[1], rtol=2e-3, atol=1e-9)


@pytest.mark.parametrize("tie", ["rigid", pytest.param("averaged", marks=pytest.mark.nightly)])
def test_a_load_along_the_link_softens_it_as_it_does_a_beam(tie: str) -> None:
    """A third of the load of buckling, pressing or pulling; without what is quadratic in the modes nothing changes."""
    critical = np.pi**2 * STEEL["young"] * SIZE[0] * SIZE[1] ** 3 / 12.0 / (4.0 * SIZE[2] ** 2)
    solid, beam = as_solid(reduced(12, tie, 12)), as_beam()

    def slowest(link: dict[str, Any], gravity: float) -> float:
        return float(machine(link, (0.0, 0.0, gravity), 50.0).natural_frequencies([0.0, 0.0])[0])

    free = slowest(beam, 0.0)
    for share in (-0.33, 0.33):
        gravity = share * critical / 50.0
        changed = slowest(beam, gravity) / free - 1.0
        assert abs(changed) > 0.1
        assert slowest(solid, gravity) / slowest(solid, 0.0) - 1.0 == pytest.approx(changed, rel=2e-3)
    linear = solid | {"second_order": False}
    assert slowest(linear, -0.33 * critical / 50.0) == pytest.approx(slowest(linear, 0.0), rel=1e-6)


def test_free_motion_keeps_energy_and_momentum() -> None:
    model = machine(as_solid(reduced()))
    n = len(model.coordinates)
    random = np.random.default_rng(3)
    q = np.array([0.1, 0.4, *(1e-3 * random.normal(size=MODES))])
    v = np.array([0.3, 5.0, *(0.05 * random.normal(size=MODES))])

    def rates(state: Array) -> Array:
        q, v = state[:n], state[n:]
        return np.concatenate([v, model.forward_dynamics(q, v, np.zeros(n))])

    def energy(state: Array) -> float:
        return float(sum(np.ravel(model.energy(state[:n], state[n:]))))

    def momentum(state: Array) -> float:
        return float((model.mass_matrix(state[:n]) @ state[n:])[0])

    state = np.concatenate([q, v])
    first = energy(state), momentum(state)
    step = 0.02 / (2.0 * np.pi * reduced().frequencies[-1])
    for _ in range(400):
        state = ahead(rates, state, step)
    assert energy(state) == pytest.approx(first[0], rel=1e-8)
    assert momentum(state) == pytest.approx(first[1], rel=1e-9)


# ---- files ------------------------------------------------------------------------------------------------


def test_matrices_from_all_files_are_the_same(tmp_path: Path) -> None:
    structure = read_structure(bar_archive(tmp_path / "bar.npz"))
    expected = reduce_structure(structure, 3).frequencies
    lower = sp.tril(structure.stiffness).tocoo()
    scipy.io.mmwrite(tmp_path / "K.mtx", sp.coo_array(structure.stiffness), symmetry="symmetric")
    scipy.io.mmwrite(tmp_path / "M.mtx", sp.coo_array(structure.mass), symmetry="symmetric")
    np.savetxt(tmp_path / "K.sti", np.column_stack([lower.row + 1, lower.col + 1, lower.data]))
    mass = sp.tril(structure.mass).tocoo()
    np.savetxt(tmp_path / "M.mas", np.column_stack([mass.row + 1, mass.col + 1, mass.data]))
    np.savetxt(tmp_path / "nodes.txt", structure.nodes)
    np.savetxt(tmp_path / "mm.txt", 1e3 * structure.nodes)
    sp.save_npz(tmp_path / "K.npz", sp.csr_array(1e-3 * structure.stiffness))
    sp.save_npz(tmp_path / "M.npz", sp.csr_array(1e-3 * structure.mass))
    for keys, tip in (
        ('stiffness = "K.mtx"\nmass_matrix = "M.mtx"\nnodes = "nodes.txt"\nmass = 0.628', 0.4),
        ('stiffness = "K.sti"\nmass_matrix = "M.mas"\nnodes = "nodes.txt"\ntriangle = true', 0.4),
        ('stiffness = "K.npz"\nmass_matrix = "M.npz"\nnodes = "mm.txt"\nunits = "mm-t-s"', 0.4),
    ):
        faces = f"[interfaces.root]\nplane = {{ z = 0.0 }}\n[interfaces.tip]\nplane = {{ z = {tip} }}\n"
        (tmp_path / "bar.toml").write_text(f"[matrices]\n{keys}\n{faces}", encoding="utf-8")
        np.testing.assert_allclose(vpm.reduce(tmp_path / "bar.toml", 3).frequencies, expected, rtol=1e-6)


def test_meshes_of_other_programs_are_read(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio", reason="meshes of other programs need meshio")
    fem = pytest.importorskip("skfem", reason="solids need scikit-fem")
    mesh = fem.MeshHex.init_tensor(
        *(np.linspace(0.0, 1e3 * size, count) for size, count in zip(SIZE, (2, 2, 5), strict=True))
    )
    from skfem.io.meshio import to_file

    to_file(mesh, str(tmp_path / "bar.inp"))
    assert meshio.read(tmp_path / "bar.inp").points.shape == (20, 3)
    text = '[solid]\nmesh = "bar.inp"\nunit = "mm"\nyoung = 206e9\npoisson = 0.0\ndensity = 7850\n'
    faces = "[interfaces.root]\nplane = { z = 0.0 }\n[interfaces.tip]\nplane = { z = 0.4 }\n"
    (tmp_path / "bar.toml").write_text(text + faces, encoding="utf-8")
    found = vpm.reduce(tmp_path / "bar.toml", 2)
    np.testing.assert_allclose(found.frequencies, reduced(4, modes=2).frequencies, rtol=1e-8)


def test_a_model_keeps_what_its_file_holds(tmp_path: Path) -> None:
    link = reduced().link
    link.save(tmp_path / "link.npz")
    again = ReducedLink.load(tmp_path / "link.npz")
    np.testing.assert_array_equal(again.point_curved, link.point_curved)
    named = machine(as_solid(reduced())).to_dict()
    named["beams"]["link"]["reduced"] = "link.npz"
    (tmp_path / "arm.toml").write_text(
        machine(as_solid(reduced())).to_toml().replace(named["beams"]["link"]["reduced"], "link.npz"), encoding="utf-8"
    )
    model = vpm.Model.load(tmp_path / "arm.toml")
    elsewhere = vpm.Model.load(model.save(tmp_path / "copy.toml"))
    assert elsewhere == model
    assert model.coordinates[2:] == tuple(f"link.mode.{i}" for i in range(MODES))
    assert model.at("reduced(2)").coordinates[2:] == ("link.mode.0", "link.mode.1")
    stiffer = model.with_parameters({"link.stiffness_factor": 4.0, "link.mass_factor": 1.0})
    free = [each.natural_frequencies([0.0, 0.0])[0] for each in (stiffer, model)]
    assert free[0] == pytest.approx(2.0 * free[1], rel=1e-9)


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "level = bezier": ({"level": "bezier(3)"}, "has modes only"),
    "too many modes": ({"level": "reduced(9)"}, "the solid has 6 modes"),
    "a length": ({"length": 0.4}, "the reduced solid says it"),
    "a damaged text": ({"reduced": "data:AAAA"}, "damaged"),
    "a file that is not there": ({"reduced": "nowhere.npz"}, "does not exist"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_links_that_cannot_be_are_refused(case: str) -> None:
    change, part = REFUSED[case]
    with pytest.raises(ModelError, match=part):
        machine(as_solid(reduced()) | change)


def test_places_and_gauges_on_a_solid_are_refused() -> None:
    content = machine(as_solid(reduced())).to_dict()
    content["joints"]["flange"]["at"] = 0.4
    with pytest.raises(ModelError, match=r"number of an interface: 0 \(root\), 1 \(tip\)"):
        vpm.Model.from_dict(content)
    content["joints"]["flange"]["at"] = 1.0
    content["gauges"] = {"strip": {"beam": "link", "at": 1.0, "x": 0.01}}
    with pytest.raises(ModelError, match="whose strains nobody knows"):
        vpm.Model.from_dict(content)


def test_matrices_of_no_solid_are_refused() -> None:
    good = witness()
    n = good.stiffness.shape[0]
    grounded = good.stiffness + sp.csr_array(([1e3 * good.stiffness.max() * 1e-3], ([30], [30])), shape=(n, n))
    skewed = good.stiffness + sp.csr_array(([1e8], ([30], [33])), shape=(n, n))
    mixed = good.mass + sp.csr_array(([1.0, 1.0], ([30, 31], [31, 30])), shape=(n, n))
    root, tip = good.interfaces
    cases = {
        "resists the": replace(good, stiffness=sp.csr_array(grounded)),
        "is not symmetric": replace(good, stiffness=sp.csr_array(skewed)),
        "couples": replace(good, mass=sp.csr_array(mixed)),
        "nodes": replace(good, nodes=good.nodes[:-1]),
        "has no nodes": replace(good, interfaces=(root, Interface("tip", np.array([], dtype=np.intp)))),
        "are numbered 0 to": replace(good, interfaces=(root, Interface("tip", tip.nodes + 1))),
        "on one line": replace(good, interfaces=(root, Interface("tip", tip.nodes[:2]))),
        "keep one": replace(good, interfaces=(root, Interface("tip", root.nodes))),
        "two interfaces": replace(good, interfaces=(root,)),
        "check the units": replace(good, nodes=1e3 * good.nodes),
        "rotation about": replace(good, nodes=good.nodes[:, [1, 0, 2]]),
    }
    for part, structure in cases.items():
        with pytest.raises(ReductionError, match=part):
            reduce_structure(structure, 2)
    with pytest.raises(ReductionError, match="1 to 64"):
        reduce_structure(good, 65)


@pytest.mark.parametrize(
    ("name", "content", "part"),
    [
        ("no.toml", "x = [", "no TOML"),
        ("none.toml", "[interfaces.root]\nplane = { z = 0 }", "needs one of the tables"),
        ("young.toml", "[solid]\nyoung = -1\ndensity = 1\n[interfaces]", "solid.young"),
        ("empty.npz", "", "cannot be read"),
        ("box.toml", "[solid]\nyoung = 1\ndensity = 1\n[interfaces]", "needs one of box and mesh"),
    ],
)
def test_files_that_describe_no_solid_are_told_in_a_sentence(
    tmp_path: Path, name: str, content: str, part: str
) -> None:
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(ReductionError, match=part):
        vpm.reduce(tmp_path / name)


def test_an_archive_without_its_parts_is_refused(tmp_path: Path) -> None:
    structure = witness()
    path = write_archive(tmp_path / "bar.npz", structure.stiffness, structure.mass, structure.nodes)
    with pytest.raises(ReductionError, match="two interfaces"):
        vpm.reduce(path)
    np.savez(tmp_path / "bare.npz", nodes=structure.nodes)
    with pytest.raises(ReductionError, match="has no stiffness"):
        vpm.reduce(tmp_path / "bare.npz")


@pytest.mark.parametrize("seed", range(3))
def test_damaged_files_of_links_are_told_in_a_sentence(seed: int) -> None:
    random = np.random.default_rng(seed)
    content = reduce_structure(witness(), 2).link.to_bytes()
    for _ in range(20):
        damaged = np.frombuffer(content, dtype=np.uint8).copy()
        damaged[random.integers(damaged.size, size=8)] ^= np.uint8(1 << random.integers(8))
        try:
            ReducedLink.from_bytes(damaged.tobytes()[: random.integers(1, damaged.size + 1)])
        except ModelError as error:
            assert "vpm reduce" in str(error)  # noqa: PT017


def test_links_whose_numbers_do_not_fit_are_refused() -> None:
    link = reduce_structure(witness(), 2).link
    changes: dict[str, dict[str, Any]] = {
        "points of shape": {"points": link.points[1:]},
        "above 0": {"squares": -link.squares},
        "not finite": {"places": np.full_like(link.places, np.nan)},
        "0 interfaces": {"interfaces": ()},
        "2 modes have 3": {"point_curved": np.ones((link.masses.size, 2, 3)), "curved": np.ones((1, 2, 6))},
    }
    for part, change in changes.items():
        with pytest.raises(ModelError, match=part):
            replace(link, **change)


def test_a_root_may_be_held_on_average() -> None:
    """What holds less lets the bar swing slower, but little."""
    structure = witness()
    root, tip = structure.interfaces
    averaged = reduce_structure(replace(structure, interfaces=(replace(root, tie="averaged"), tip)), 3)
    shares = averaged.frequencies / reduce_structure(structure, 3).frequencies
    assert (shares < 1.0).all()
    assert (shares > 0.9).all()
