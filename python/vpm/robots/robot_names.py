"""Names of a robot's parts, changed to what a model file takes, each once."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from vpm.model.joint import SUFFIXES, JointType
from vpm.robots.markup import clean

_RESERVED = ("world", "time")


@dataclass
class Names:
    """Names of robot parts given so far, and notes of those that had to be changed."""

    taken: set[str] = field(default_factory=lambda: set(_RESERVED))
    notes: list[str] = field(default_factory=list)

    def of(self, what: str, name: str, suffixes: Sequence[str] = ("",)) -> str:
        """Model-file name for a robot's name.

        Parameters
        ----------
        what : str
            ``"joint"``, ``"link"``: what is put before or behind a name that will not do, and stands in the note.
        name : str
        suffixes : sequence of str
            Of the names that it brings with it, such as the coordinates of a joint.
        """
        safe = re.sub(r"[^A-Za-z0-9_-]", "_", name)
        if not safe[:1].isalpha():
            safe = f"{what}_{safe.lstrip('_')}"
        wanted, count = safe, 1
        while any(f"{wanted}{suffix}" in self.taken for suffix in ("", *suffixes)):
            wanted = f"{safe}_{what}" if count == 1 else f"{safe}_{what}_{count}"
            count += 1
        self.taken.update(f"{wanted}{suffix}" for suffix in ("", *suffixes))
        if wanted != name:
            self.notes.append(f'{what} "{clean(name)}" is called {wanted}')
        return wanted

    def joint(self, name: str, kind: JointType) -> str:
        """Model-file name for a robot's joint, with those of its coordinates."""
        return self.of("joint", name, SUFFIXES[kind])

    def made(self, name: str) -> str:
        """Model-file name of a part without a name in the robot file; it needs no note."""
        before = len(self.notes)
        given = self.of("part", name)
        del self.notes[before:]
        return given
