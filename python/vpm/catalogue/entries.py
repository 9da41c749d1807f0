"""All effects by name: those of vpm, those that a program registered, and those of other packages."""

from collections.abc import Iterator, Mapping
from typing import Any

from vpm.catalogue.effects import BUILT_IN
from vpm.catalogue.kinds import EffectType
from vpm.catalogue.own import entry_of
from vpm.errors import VpmError
from vpm.plugins import Plugin, PluginError, complain, plugins, told, usable

OWN = frozenset(effect.name for effect in BUILT_IN)


class Catalogue(Mapping[str, EffectType]):
    """Effects in the order in which a page lists them; those of other packages come last.

    An effect of another package is imported when somebody asks for it, or has come to the end of all others.

    Attributes
    ----------
    entries : dict of str to EffectType
        What is there without asking other packages.
    troubles : dict of str to str
        Why effects of other packages cannot be used.
    """

    def __init__(self) -> None:
        self.entries = {effect.name: effect for effect in BUILT_IN}
        self.troubles: dict[str, str] = {}

    def __getitem__(self, name: str) -> EffectType:
        if name not in self.entries and name in (offered := plugins("effects", OWN)):
            self._take(offered[name])
        return self.entries[name]

    def __iter__(self) -> Iterator[str]:
        yield from (there := list(self.entries))
        later = (name for name in usable("effects", OWN) if name not in there)
        yield from (name for name in later if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def _take(self, plugin: Plugin) -> None:
        """Import an effect's entry; a warning says why one cannot be used."""
        if plugin.name in self.troubles:
            return
        try:
            self.entries[plugin.name] = _entry(plugin)
        except PluginError as error:
            self.troubles[plugin.name] = str(error)
            complain(str(error))


def _entry(plugin: Plugin) -> EffectType:
    """Entry that an entry point describes: arguments of `vpm.catalogue.register`, or a function that gives them."""
    found = plugin.load()
    try:
        arguments: Any = found() if callable(found) else found
        entry = entry_of(plugin.name, **dict(arguments))
    except VpmError as error:
        raise plugin.error(f"cannot be used: {error}") from error
    except Exception as error:
        rest = f"is not described by the arguments of vpm.catalogue.register ({told(error)}); correct or uninstall it"
        raise plugin.error(rest) from error
    if unknown := set(entry.confused_with) - OWN - set(plugins("effects", OWN)):
        raise plugin.error(
            f"names effects that nobody has in confused_with: {', '.join(sorted(unknown))}; correct them"
        )
    return entry
