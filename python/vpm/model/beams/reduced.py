"""Reduced solids as links: the numbers of a file that `vpm reduce` writes, and where a model keeps them.

A model holds the whole file as text, so that it is complete in itself: it can be saved elsewhere, sent to another
process, and does not need the file again.
"""

import base64
import binascii
import io
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np

from vpm.errors import ModelError
from vpm.files import replacing, unreadable
from vpm.numbers import Array

#: What the text of a solid begins with in a model; everything else is the name of a file.
EMBEDDED = "data:"
#: Most modes, interfaces and bytes of a file: beyond them it is no reduced solid, or one that no machine could use.
MODES, INTERFACES, BYTES = 64, 32, 50_000_000


@dataclass(frozen=True, eq=False)
class ReducedLink:
    """A solid of finite elements, held at its root and reduced to modes of unit modal mass; SI, in its root frame.

    A material point is at ``x + sum_i shape_i q_i + 1/2 sum_ij curved_ij q_i q_j``; frames have the rotation vector
    before the place. Pairs ``i <= j`` stand at ``j (j + 1) / 2 + i``.
    """

    squares: Array  #: Squared angular frequencies (1/s^2), ascending, shape (n,).
    masses: Array  #: Point masses with the inertia of the solid (kg), shape (s,).
    #: Their fields, shapes (s, 3), (s, n, 3), (s, n (n + 1) / 2, 3); no pairs where nothing is known of them.
    points: Array
    point_shapes: Array
    point_curved: Array
    interfaces: tuple[str, ...]  #: Names of the frames that carry something, but that of the root.
    #: Their places, shape (m, 3), and fields, shapes (m, n, 6) and (m, n (n + 1) / 2, 6).
    places: Array
    shapes: Array
    curved: Array

    def __post_init__(self) -> None:
        for name in _ARRAYS:
            # Numbers that are nothing beside the others would be worked out in every step.
            array = np.array(getattr(self, name), dtype=np.float64)
            array[np.abs(array) < 1e-14 * np.abs(array).max(initial=0.0)] = 0.0
            object.__setattr__(self, name, array)
        if problem := self._problem():
            raise ModelError(f"the reduced solid {problem}; write it again with vpm reduce")

    def _problem(self) -> str:
        n, s, m = self.squares.size, self.masses.size, len(self.interfaces)
        if not 1 <= n <= MODES:
            return f"has {n} modes, but 1 to {MODES} are possible"
        if not 1 <= m <= INTERFACES:
            return f"has {m} interfaces beside its root, but 1 to {INTERFACES} are possible"
        if not 1 <= s <= 3 * n + 4:
            return f"has {s} point masses, but {n} modes need 1 to {3 * n + 4}"
        pairs = self.point_curved.shape[1] if self.point_curved.ndim == 3 else -1
        expected = {"squares": (n,), "masses": (s,), "points": (s, 3), "point_shapes": (s, n, 3)}
        expected |= {"point_curved": (s, pairs, 3), "places": (m, 3), "shapes": (m, n, 6), "curved": (m, pairs, 6)}
        for name, shape in expected.items():
            if getattr(self, name).shape != shape:
                return f"has {name} of shape {getattr(self, name).shape}, which should be {shape}"
            if not np.isfinite(getattr(self, name)).all():
                return f"has numbers in {name} that are not finite"
        if pairs not in (0, n * (n + 1) // 2):
            return f"has {pairs} pairs of modes, but {n} modes have {n * (n + 1) // 2}"
        for name in ("squares", "masses"):
            if not getattr(self, name).min() > 0.0:
                return f"has {getattr(self, name).min():.3g} among {name}, but all have to be above 0"
        return ""

    @property
    def mass(self) -> float:
        """Mass of a reduced solid (kg)."""
        return float(self.masses.sum())

    @property
    def frequencies(self) -> Array:
        """Natural frequencies (Hz) of the reduced solid held at its root."""
        return np.sqrt(self.squares) / (2.0 * np.pi)

    @property
    def stiffens(self) -> bool:
        """Whether a reduced solid stiffens by tension and spin: it knows terms quadratic in its modes."""
        return bool(self.point_curved.shape[1])

    def to_bytes(self) -> bytes:
        """Content of a file of a reduced solid."""
        content = io.BytesIO()
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        np.savez_compressed(content, allow_pickle=False, interfaces=np.array(self.interfaces), **arrays)
        return content.getvalue()

    @classmethod
    def from_bytes(cls, content: bytes) -> Self:
        """Reduced solid from a file's content."""
        try:
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                if sum(member.file_size for member in archive.infolist()) > BYTES:
                    raise ModelError(f"the reduced solid has more than {BYTES:.0e} bytes; keep fewer modes")
            with np.load(io.BytesIO(content), allow_pickle=False) as stored:
                found: dict[str, Any] = {name: stored[name] for name in _ARRAYS}
                found["interfaces"] = tuple(str(name) for name in stored["interfaces"])
            return cls(**found)
        except KeyError as error:
            name = str(error.args[0]).split()[0]
            raise ModelError(f"the file has no {name}, so it is no reduced solid; write one with vpm reduce") from None
        except (ValueError, TypeError, OSError, EOFError, MemoryError, zlib.error, zipfile.BadZipFile) as error:
            raise ModelError(
                f"the file is no reduced solid, or damaged ({str(error)[:80]}); write one with vpm reduce"
            ) from None

    def save(self, path: str | PathLike[str]) -> Path:
        """Write a file that ``reduced = "..."`` of a flexible link names."""
        with replacing(path) as beside:
            beside.write_bytes(self.to_bytes())
        return Path(path)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a reduced solid from a file that `save` wrote.

        Raises `ModelError`: it is not there, or something else.
        """
        return cls.from_bytes(read_bytes(path))

    @property
    def text(self) -> str:
        """Numbers of a reduced solid as text, which may stand for the name of a file in a model's content."""
        return embedded(self.to_bytes())

    def content(self) -> Mapping[str, Any]:
        """Numbers of a reduced solid as the core reads them."""

        def field(rest: Array, shapes: Array, curved: Array) -> dict[str, Any]:
            return {"rest": rest.tolist(), "shapes": shapes.tolist(), "curved": curved.tolist()}

        rest = np.hstack([np.zeros_like(self.places), self.places])
        return {
            "squares": self.squares.tolist(),
            "masses": self.masses.tolist(),
            "points": [field(*of) for of in zip(self.points, self.point_shapes, self.point_curved, strict=True)],
            "interfaces": [field(*of) for of in zip(rest, self.shapes, self.curved, strict=True)],
        }


_ARRAYS = tuple(field.name for field in fields(ReducedLink) if field.name != "interfaces")


def read_bytes(path: str | PathLike[str]) -> bytes:
    """Content of a file of a reduced solid."""
    if reason := unreadable(path):
        raise ModelError(reason)
    try:
        if Path(path).stat().st_size > BYTES:
            raise ModelError(f"{path} has more than {BYTES:.0e} bytes; name a smaller file")
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise ModelError(f"{path} does not exist; check the path") from None
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror or error}") from None


def embedded(content: bytes) -> str:
    """Text that stands for a reduced solid's file in a model."""
    return EMBEDDED + base64.b64encode(content).decode("ascii")


def link_of(text: str) -> ReducedLink:
    """Reduced solid that a text of `embedded` stands for."""
    try:
        content = base64.b64decode(text.removeprefix(EMBEDDED), validate=True)
    except (binascii.Error, ValueError):
        raise ModelError("the reduced solid is damaged; name its file again") from None
    return ReducedLink.from_bytes(content)
