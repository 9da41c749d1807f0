"""What other packages offer to vpm by entry points: effects, readers of logs, importers of robots.

Nothing of such a package is imported before it is needed; see ``docs/plugins.md``.
"""

import warnings
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points

from vpm.errors import PluginWarning, VpmError

#: Kinds of plugins, in words; the group of entry points is ``vpm.`` and the kind.
KINDS = {"effects": "effect", "readers": "reader", "importers": "importer"}


class PluginError(VpmError):
    """What another package offers cannot be used."""

    def __init__(self, message: str, *, plugin: str = "", package: str = "") -> None:
        super().__init__(message)
        self.plugin = plugin
        self.package = package


@dataclass(frozen=True)
class Plugin:
    """An effect, reader or importer that another package offers by an entry point."""

    kind: str  #: One of {"effects", "readers", "importers"}.
    name: str  #: Of an effect, or the ending of the files that are read or imported, without its dot.
    package: str  #: Who offers it, with version.
    refused: str  #: Why it is not used, as the end of a sentence; "" where it is.
    point: EntryPoint

    def __str__(self) -> str:
        return f"the {KINDS[self.kind]} {self.name} of the package {self.package}"

    def load(self) -> object:
        """Load what a plugin's entry point names.

        Raises `PluginError`: its package cannot be imported, or the name was refused.
        """
        if self.refused:
            raise self.error(self.refused)
        try:
            return self.point.load()
        except Exception as error:
            raise self.error(f"cannot be imported ({told(error)}); update or uninstall the package") from error

    def error(self, rest: str) -> PluginError:
        """Error about this plugin; ``rest`` ends the sentence."""
        return PluginError(f"{self} {rest}", plugin=self.name, package=self.package)


def told(error: BaseException) -> str:
    """Error of a plugin's package in a few words."""
    words = str(error).strip().splitlines()
    return f"{type(error).__name__}: {words[0][:200]}" if words else type(error).__name__


def plugins(kind: str, taken: Collection[str] = ()) -> dict[str, Plugin]:
    """Plugins of a kind by name, also those that are refused.

    Parameters
    ----------
    kind : {"effects", "readers", "importers"}
    taken : collection of str
        Names that vpm has itself.
    """
    found: dict[str, Plugin] = {}
    for name, offers in sorted(_offers(kind).items()):
        packages = [package for package, _ in offers]
        refused = ""
        if name in taken:
            refused = "is refused, because vpm has one of this name; rename it"
        elif len(offers) > 1:
            refused = (
                f"is refused, because {' and '.join(packages[1:])} has one of this name too; uninstall one of them"
            )
        found[name] = Plugin(kind, name, packages[0], refused, offers[0][1])
    return found


def usable(kind: str, taken: Collection[str] = ()) -> dict[str, Plugin]:
    """Plugins of a kind that are not refused; a warning tells of the others."""
    found = plugins(kind, taken)
    for one in found.values():
        if one.refused:
            complain(str(one.error(one.refused)))
    return {name: one for name, one in found.items() if not one.refused}


def complain(sentence: str) -> None:
    """Warn of a plugin, once in a process."""
    if sentence not in _complaints:
        _complaints.add(sentence)
        warnings.warn(sentence, PluginWarning, stacklevel=3)


_complaints: set[str] = set()


@cache
def _offers(kind: str) -> Mapping[str, list[tuple[str, EntryPoint]]]:
    """Plugins by name: packages and entry points; looking for them takes some milliseconds."""
    found: dict[str, list[tuple[str, EntryPoint]]] = {}
    for point in entry_points(group=f"vpm.{kind}"):
        package = f"{point.dist.name} {point.dist.version}" if point.dist is not None else "an unknown package"
        found.setdefault(point.name, []).append((package, point))
    return {name: sorted(offers, key=lambda offer: offer[0]) for name, offers in found.items()}


def forget() -> None:
    """Look for plugins anew, after packages were installed while the program runs."""
    _offers.cache_clear()
    _complaints.clear()
