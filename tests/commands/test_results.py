"""Results: what is saved comes back exactly, and nothing else is read."""

import pickle
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from vpm.errors import DivergedError, MissingExtraError, ModelError, VpmError, near_match
from vpm.model import Model
from vpm.results import Result, Storable, html_table


@dataclass(frozen=True, repr=False, eq=False)
class Part(Storable):
    """Something nested."""

    label: str
    content: object


@dataclass(frozen=True, repr=False, eq=False)
class Sample(Result):
    """A result with one field of every kind."""

    time: NDArray[np.float64]
    parts: tuple[Part, ...]
    content: object = None

    def _frame_columns(self) -> Mapping[str, object]:
        return {"time_s": self.time}


@dataclass(frozen=True, repr=False, eq=False)
class Other(Result):
    """A result of another class, without a table form."""

    value: float


values = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(),
        hnp.arrays(st.sampled_from([np.float64, np.int64, np.bool_, np.complex128]), hnp.array_shapes(max_dims=3)),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.lists(inner, max_size=3).map(tuple),
        st.dictionaries(st.text(), inner, max_size=3),
        st.builds(Part, st.text(), inner),
    ),
    max_leaves=8,
)


@given(values)
def test_saved_and_loaded_it_is_the_same(tmp_path_factory: pytest.TempPathFactory, content: object) -> None:
    sample = Sample(np.array([0.0, 0.1, np.nan]), (Part("a", content), Part("b", np.inf)), content)
    path = sample.save(tmp_path_factory.mktemp("results") / "sample.npz")
    again = Sample.load(path)
    assert again == sample
    assert type(again.content) is type(content)
    assert repr(again) == repr(sample)


def test_arrays_whose_places_are_written_alike_stay_apart(tmp_path: Path) -> None:
    content = {"a": {"b": np.zeros(1)}, "a.b": np.ones(1), "a/b": np.full(1, 2.0), "a\0b": np.full(1, 3.0)}
    sample = Sample(np.zeros(1), (), content)
    assert Sample.load(sample.save(tmp_path / "alike.npz")) == sample


def test_equality_looks_inside_arrays() -> None:
    one = Sample(np.array([1.0, np.nan]), ())
    assert one == Sample(np.array([1.0, np.nan]), ())
    assert one != Sample(np.array([1.0, 2.0]), ())
    assert one != Sample(np.array([1, 2]), ())
    assert one != Sample(np.array([1.0, np.nan]), (), content=[])
    assert Part("a", (1,)) != Part("a", [1])
    with pytest.raises(TypeError, match="no hash"):
        hash(one)


def test_models_are_stored_inside_results(emps: Model, tmp_path: Path) -> None:
    rough = emps.with_effect("coulomb_friction", at="axis", coulomb=0.1 + 0.2)
    path = Sample(np.zeros(2), (), rough).save(tmp_path / "with_model.npz")
    assert Sample.load(path).content == rough


def test_texts_are_one_line_and_escaped() -> None:
    sample = Sample(np.zeros((3, 2)), (Part("<b>", 1.23456789),), {"k": 1})
    assert repr(sample) == "Sample(time=<3 x 2 array>, parts=(Part(label='<b>', content=1.23457)), content=<1 entries>)"
    page = sample._repr_html_()
    assert "<b>" not in page
    assert "&lt;b&gt;" in page
    assert html_table("x", ("a",), [("1 < 2",)]).count("<td>1 &lt; 2</td>") == 1


def test_tables(monkeypatch: pytest.MonkeyPatch) -> None:
    sample = Sample(np.array([0.0, 0.5]), ())
    frame = sample.to_frame()
    assert list(frame.columns) == ["time_s"]
    assert frame["time_s"].tolist() == [0.0, 0.5]
    with pytest.raises(VpmError, match="no table form"):
        Other(1.0).to_frame()
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(MissingExtraError, match=r'pip install "vpm-dynamics\[frames\]"'):
        sample.to_frame()


def test_files_that_are_no_such_result(tmp_path: Path) -> None:
    path = Other(2.0).save(tmp_path / "other.npz")
    with pytest.raises(VpmError, match=r"holds a Other in place of a Sample; use Other\.load"):
        Sample.load(path)
    with pytest.raises(VpmError, match="does not exist"):
        Sample.load(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("no archive", encoding="utf-8")
    with pytest.raises(VpmError, match=r"text\.npz is not a saved result"):
        Sample.load(tmp_path / "text.npz")
    np.savez(tmp_path / "plain.npz", a=np.zeros(2))
    with pytest.raises(VpmError, match="header is missing"):
        Sample.load(tmp_path / "plain.npz")
    np.save(tmp_path / "single.npy", np.zeros(2))
    with pytest.raises(VpmError, match=r"no \.npz file"):
        Sample.load(tmp_path / "single.npy")


def test_damaged_files_are_named(tmp_path: Path) -> None:
    path = Sample(np.random.default_rng(1).normal(size=1000), ()).save(tmp_path / "sample.npz")
    content = bytearray(path.read_bytes())
    middle = len(content) // 2  # inside the compressed numbers
    content[middle : middle + 100] = bytes(100)
    path.write_bytes(content)
    with pytest.raises(VpmError, match=r"sample\.npz cannot be read"):
        Sample.load(path)


@pytest.mark.parametrize("value", [None, "much", (1.0,), True, np.zeros(2)])
def test_a_field_of_another_type_is_named(tmp_path: Path, value: object) -> None:
    path = Other(value).save(tmp_path / "file.npz")  # type: ignore[arg-type]
    with pytest.raises(VpmError, match=r"Other\.value cannot be .*; write it anew"):
        Other.load(path)


def test_an_array_whose_head_is_damaged_is_named(tmp_path: Path) -> None:
    """NumPy reads the head as Python's text, and a bracket without its other half is no end of it."""
    with zipfile.ZipFile(tmp_path / "file.npz", "w") as archive:
        head = b"{'descr': '<f8', 'fortran_order': False, 'shape': ((((, }".ljust(117) + b"\n"
        archive.writestr("header.npy", b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head)
    with pytest.raises(VpmError, match="cannot be read as a saved result"):
        Other.load(tmp_path / "file.npz")


def test_pickled_objects_are_never_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "evil.npz", header=np.array([{"a": 1}], dtype=object))
    with pytest.raises(VpmError, match="plain arrays"):
        Sample.load(tmp_path / "evil.npz")


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ('{"format": 99, "content": null}', "format 99"),
        ('{"format": 1, "content": {"$": "object os:system", "content": {}}}', "not known here"),
        ('{"format": 1, "content": {"$": "object vpm.nothing:X", "content": {}}}', "not known here"),
        ('{"format": 1, "content": {"$": "array", "content": "gone"}}', "does not fit this version"),
        ('{"format": 1, "content": {"$": "object vpm.model.model:Model", "content": {}}}', "does not fit this version"),
        ('{"format": 1, "content": 3}', "holds a int in place of"),
        ("no json", "unreadable"),
    ],
)
def test_headers_that_are_wrong(tmp_path: Path, header: str, words: str) -> None:
    np.savez(tmp_path / "file.npz", header=np.array(header))
    with pytest.raises(VpmError, match=words):
        Sample.load(tmp_path / "file.npz")


def test_what_cannot_be_stored_is_named(tmp_path: Path) -> None:
    for content, words in [
        (object(), "Sample.content cannot be stored: it is a object"),
        ({1: 2}, "keys of a mapping"),
        (np.array([None]), "not of numbers or text"),
        ({"deep": [{1, 2}]}, r"Sample.content.deep.0 cannot be stored: it is a set"),
    ]:
        with pytest.raises(VpmError, match=words):
            Sample(np.zeros(1), (), content).save(tmp_path / "x.npz")
    assert not (tmp_path / "x.npz").exists()


def test_files_are_compressed_archives_of_arrays_and_text(tmp_path: Path) -> None:
    path = Sample(np.zeros(100_000), ()).save(tmp_path / "large.npz")
    assert path.stat().st_size < 10_000
    assert sorted(zipfile.ZipFile(path).namelist()) == ["0_Sample.time.npy", "header.npy"]


def test_errors_survive_pickling() -> None:
    error = pickle.loads(pickle.dumps(ModelError("m", where="a.b", path="f", line=3, more=2)))
    assert (str(error), error.where, error.path, error.line, error.more) == ("m", "a.b", "f", 3, 2)
    missing = pickle.loads(pickle.dumps(MissingExtraError("jinja2", "report")))
    assert (missing.package, missing.extra) == ("jinja2", "report")
    assert isinstance(missing, ImportError)
    diverged = pickle.loads(pickle.dumps(DivergedError("d", run=(1, 2), time=0.5)))
    assert (diverged.run, diverged.time) == ((1, 2), 0.5)


def test_near_matches() -> None:
    assert near_match("viscos", ["viscous", "mass"]) == 'did you mean "viscous"?'
    assert near_match("axis.viscous", ["axis.friction.viscous", "b"]) == 'did you mean "axis.friction.viscous"?'
    assert near_match("zzz", ["b", "a"]) == "the choices are a, b"
    assert near_match("zzz", map(str, range(20))).endswith("and 8 more")
    assert near_match("zzz", []) == "there are none here"
