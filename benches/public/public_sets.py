"""Records of public benchmarks of nonlinear system identification, divided as their scores ask for.

Files are read where they are at hand, in the layouts that the packages `nonlinear_benchmarks` and `identibench` leave:
``load("silverbox", "data/Silverbox")`` finds the MATLAB files of the set or the HDF5 files in ``train/`` and ``test/``.
Nothing is fetched.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.io import loadmat

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Series:
    """Inputs and outputs at equal steps.

    Attributes
    ----------
    name : str
    u, y : ndarray, shape (samples, channels)
    dt : float
        Time between samples, s.
    """

    name: str
    u: Array
    y: Array
    dt: float

    def __getitem__(self, rows: slice) -> Series:
        return Series(self.name, self.u[rows], self.y[rows], self.dt)

    def named(self, name: str) -> Series:
        """The same under another name."""
        return Series(name, self.u, self.y, self.dt)


@dataclass(frozen=True)
class Split:
    """What a fit may see, and what it is scored by.

    Attributes
    ----------
    train, test : tuple of Series
    window : int
        Samples at the start of each test record that no score counts: first states may be found there.
    """

    train: tuple[Series, ...]
    test: tuple[Series, ...]
    window: int


@dataclass(frozen=True)
class PublicSet:
    """How the files of one set are read.

    Attributes
    ----------
    files : tuple of str
        Patterns of its MATLAB files.
    read : callable
        Turns their contents, by the stem of each, into a split.
    window : int
        See `Split`.
    source : str
        Who measured it.
    """

    files: tuple[str, ...]
    read: Callable[[Mapping[str, Mapping[str, Any]]], tuple[Iterable[Series], Iterable[Series]]]
    window: int
    source: str


def _series(name: str, u: ArrayLike, y: ArrayLike, dt: ArrayLike) -> Series:
    columns = [np.asarray(values, dtype=float).squeeze() for values in (u, y)]
    u, y = (values[:, None] if values.ndim == 1 else values for values in columns)
    return Series(name, u, y, float(np.squeeze(dt)))


def _emps(files: Mapping[str, Mapping[str, Any]]) -> tuple[Iterable[Series], Iterable[Series]]:
    read = {
        name: _series(name, data["vir"], data["qm"], float(np.diff(np.ravel(data["t"])[:2])[0]))
        for name, data in files.items()
    }
    return [read["DATA_EMPS"]], [read["DATA_EMPS_PULSES"]]


def _silverbox(files: Mapping[str, Mapping[str, Any]]) -> tuple[Iterable[Series], Iterable[Series]]:
    data = files["SNLS80mV"]
    whole = _series("silverbox", data["V1"], data["V2"], 1.0 / 610.35)
    arrow, sines = whole[100:40575], whole[40650:127400]
    own = int(len(sines.u) * 0.75)
    tests = sines[own:].named("multisine"), arrow.named("arrow"), arrow[:32000].named("arrow, no extrapolation")
    return [sines[:own]], tests


def _tanks(files: Mapping[str, Mapping[str, Any]]) -> tuple[Iterable[Series], Iterable[Series]]:
    data = files["dataBenchmark"]
    estimation, validation = (_series(name, data[f"u{name}"], data[f"y{name}"], data["Ts"]) for name in ("Est", "Val"))
    return [estimation], [validation]


def _drives(files: Mapping[str, Mapping[str, Any]]) -> tuple[Iterable[Series], Iterable[Series]]:
    data = files["DATAUNIF"]
    records = [_series(name, data[f"u{k}"], data[f"z{k}"], 0.02) for name, k in (("low", 11), ("high", 12))]
    return [r[:400] for r in records], [r[400:] for r in records]


def _wiener_hammerstein(files: Mapping[str, Mapping[str, Any]]) -> tuple[Iterable[Series], Iterable[Series]]:
    data = files["WienerHammerBenchMark"]
    whole = _series("wiener_hammerstein", data["uBenchMark"], data["yBenchMark"], 1.0 / np.squeeze(data["fs"]))
    counted = whole[5200:184000]
    return [counted[:100_000]], [counted[100_000:]]


def _f16(files: Mapping[str, Mapping[str, Any]]) -> tuple[Iterable[Series], Iterable[Series]]:
    read = {
        name: _series(name, np.ravel(data["Force"]), np.transpose(data["Acceleration"]), 1.0 / np.squeeze(data["Fs"]))
        for name, data in sorted(files.items())
        if "SpecialOddMSine" not in name
    }
    tests = {name for name in read if "Validation" in name}
    return [r for n, r in read.items() if n not in tests], [read[n] for n in sorted(tests)]


def _bouc_wen(files: Mapping[str, Mapping[str, Any]]) -> tuple[Iterable[Series], Iterable[Series]]:
    def pair(kind: str) -> Series:
        u, y = (files[f"{letter}val_{kind}"][f"{letter}val_{kind}"] for letter in "uy")
        return _series(kind, u, y, 1.0 / 750.0)

    return [], [pair("multisine"), pair("sinesweep")]


def _kuka(files: Mapping[str, Mapping[str, Any]]) -> tuple[Iterable[Series], Iterable[Series]]:
    data = files["forward_identification_without_raw_data"]
    train, test = (_series(name, data[f"u_{name}"].T, data[f"y_{name}"].T, 0.1) for name in ("train", "test"))
    return [train], [test]


SETS: Mapping[str, PublicSet] = {
    "emps": PublicSet(("DATA_EMPS*.mat",), _emps, 20, "Janot, Gautier and Brunot 2019"),
    "silverbox": PublicSet(("SNLS80mV.mat",), _silverbox, 50, "Wigren and Schoukens 2013"),
    "cascaded_tanks": PublicSet(("dataBenchmark.mat",), _tanks, 50, "Schoukens, Mattsson, Wigren and Noel 2016"),
    "coupled_drives": PublicSet(("DATAUNIF.MAT",), _drives, 10, "Wigren and Schoukens 2017"),
    "wiener_hammerstein": PublicSet(
        ("WienerHammerBenchMark.mat",), _wiener_hammerstein, 50, "Schoukens, Suykens and Ljung 2009"
    ),
    "f16": PublicSet(("F16Data_*.mat",), _f16, 50, "Noel and Schoukens 2017"),
    "bouc_wen": PublicSet(("[uy]val_*.mat",), _bouc_wen, 50, "Noel and Schoukens 2016"),
    "kuka": PublicSet(
        ("forward_identification_without_raw_data.mat",), _kuka, 100, "Weigand, Goetz, Ulmen and Ruskowski 2022"
    ),
}


def load(name: str, folder: str | Path) -> Split:
    """A set, from the files below ``folder``.

    Raises
    ------
    FileNotFoundError
        There are none.
    """
    here, chosen = Path(folder), SETS[name]
    if (here / "train").is_dir() and (here / "test").is_dir():
        train, test = (_hdf5(here / part) for part in ("train", "test"))
        return Split(train, test, chosen.window)
    found = sorted({path for pattern in chosen.files for path in here.rglob(pattern)})
    files = {path.stem: loadmat(path) for path in found}
    try:
        train, test = (tuple(part) for part in chosen.read(files))
    except KeyError as missing:
        raise FileNotFoundError(
            f"{here} has no {missing} of the set {name}; put there what its authors give ({', '.join(chosen.files)}),"
            " or folders train and test of HDF5 files"
        ) from None
    return Split(train, test, chosen.window)


def _hdf5(folder: Path) -> tuple[Series, ...]:
    """Files with columns u0, u1, ... and y0, y1, ...; the attribute fs is their rate, or dt the step."""
    import h5py

    series = []
    for path in sorted(folder.glob("*.hdf5")):
        with h5py.File(path) as file:
            u, y = (
                np.column_stack([file[c] for c in sorted((c for c in file if c[0] == letter), key=_number)])
                for letter in "uy"
            )
            dt = 1.0 / float(file.attrs["fs"]) if "fs" in file.attrs else float(file["dt"][0])
        series.append(_series(path.stem, u, y, dt))
    return tuple(series)


def _number(column: str) -> int:
    return int(column[1:])
