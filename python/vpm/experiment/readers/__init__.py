"""Files of logs: which reader takes which, told by the ending of the name."""

from collections.abc import Mapping
from importlib import import_module
from os import PathLike
from pathlib import Path

from vpm.errors import ExperimentError
from vpm.experiment.readers.base import Log, reading
from vpm.files import unreadable
from vpm.plugins import Plugin, usable

#: Endings of the formats beside text.
PARQUET = (".parquet", ".pq")
MATLAB = (".mat",)
HDF5 = (".h5", ".hdf5", ".hdf", ".he5")
BAGS = (".bag", ".db3", ".mcap")
MDF = (".mf4", ".mdf")
TDMS = (".tdms",)
ULOG = (".ulg",)
ENDINGS = (".csv", ".tsv", ".txt", *PARQUET, *MATLAB, *HDF5, *BAGS, *MDF, *TDMS, *ULOG)

#: Module and class, or function, that opens files of these endings.
_READERS: Mapping[tuple[str, ...], tuple[str, str]] = {
    PARQUET: ("parquet", "ParquetLog"),
    MATLAB: ("mat", "open_mat"),
    HDF5: ("hdf5", "Hdf5Log"),
    (".mcap",): ("mcap_json", "open_mcap"),
    BAGS: ("ros", "BagLog"),
    MDF: ("mdf", "open_mdf"),
    TDMS: ("tdms", "TdmsLog"),
    ULOG: ("ulog", "UlogLog"),
}

OWN = frozenset(ending[1:] for ending in ENDINGS)


def open_log(path: str | PathLike[str]) -> Log:
    """Reader for a file of a log: its columns by name, and their numbers.

    ``path``: ``.csv`` and every ending that is not named here is text; ``.parquet`` and ``.pq`` need the extra
    ``parquet``; ``.mat`` of MATLAB up to 7.2 needs none, of 7.3 the extra ``hdf5``, as do ``.h5``, ``.hdf5``, ``.hdf``
    and ``.he5``; ``.bag`` (ROS 1), ``.db3`` and ``.mcap`` and folders with a ``metadata.yaml`` (ROS 2) need the extra
    ``ros``; ``.mf4`` and ``.mdf`` the extra ``mdf``, ``.tdms`` of LabVIEW ``tdms``, ``.ulg`` of PX4 ``ulog``; folders
    of LeRobot, and ``FOLDER/episode_000003`` in them, ``parquet``. Other packages may bring more.
    """
    if reason := unreadable(path):
        raise ExperimentError(reason, path=str(path))
    with reading(path):
        return _opened(path)


def _opened(path: str | PathLike[str]) -> Log:
    file = Path(path)
    ending = file.suffix.lower()
    for endings, (module, name) in _READERS.items():
        if ending not in endings:
            continue
        if not file.exists():
            raise ExperimentError(f"{path} does not exist; check the name and the folder", path=str(path))
        return _by(module, name, path)
    if (file / "metadata.yaml").is_file():
        return _by("ros", "BagLog", path)
    from vpm.experiment.readers.lerobot import EpisodeLog, is_data_set, is_episode

    if is_data_set(file) or (not file.exists() and is_episode(file)):
        return EpisodeLog(path)
    if plugin := usable("readers", OWN).get(ending[1:]):
        return _by_plugin(plugin, path)
    if file.is_dir():
        raise ExperimentError(
            f"{path} cannot be read: it is a folder without a metadata.yaml, so no ROS 2 bag, and without a "
            "meta/info.json, so no data set of LeRobot; give the path of a file",
            path=str(path),
        )
    from vpm.experiment.readers.text import TextLog

    return TextLog(path)


def _by(module: str, name: str, path: str | PathLike[str]) -> Log:
    """Log by a reader of this package, imported only now."""
    opened: Log = getattr(import_module(f"vpm.experiment.readers.{module}"), name)(path)
    return opened


def _by_plugin(plugin: Plugin, path: str | PathLike[str]) -> Log:
    """Log by a reader of another package: what it names is called with the path."""
    if not Path(path).exists():
        raise ExperimentError(f"{path} does not exist; check the name and the folder", path=str(path))
    log = reader(path) if callable(reader := plugin.load()) else reader
    if not isinstance(log, Log):
        raise plugin.error(f"gave a {type(log).__name__} for {path}; it has to give a vpm.experiment.readers.Log")
    return log
