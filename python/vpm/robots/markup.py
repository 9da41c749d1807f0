"""XML of robots: elements with their lines and bytes, read so that no file can harm or change beside what was asked.

There are no entities, no document types and no other files, so nothing grows and nothing is fetched.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

from vpm.errors import ModelError
from vpm.files import unreadable
from vpm.numbers import LARGEST

#: Largest file, bytes; shapes are in files of their own, so that a robot takes some hundred thousand.
LARGEST_FILE = 1 << 25
#: Deepest nesting of a URDF is five; of MJCF it is that of the tree of bodies.
DEEPEST = 500

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)


@dataclass
class Element:
    """One element of an XML file."""

    tag: str
    attributes: dict[str, str]
    line: int  #: Where it begins, from 1.
    #: Bytes at which its first tag and its last one begin; the latter says nothing of an empty element, ``<a/>``.
    start: int
    close: int = -1
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """Children of a markup element with one tag."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """First child of a markup element with one tag."""
        return next(self.all(tag), None)


@dataclass(frozen=True)
class Markup:
    """Elements of an XML file, with errors that name file and line."""

    path: str
    content: bytes
    root: Element

    def fail(self, element: Element, text: str) -> NoReturn:
        """Raise an error about an element of the markup."""
        raise ModelError(f"{self.path}, line {element.line}: {text}", path=self.path, line=element.line)

    def need(self, element: Element, tag: str, whose: str) -> Element:
        """Child of a markup element that has to be there."""
        if (child := element.first(tag)) is None:
            self.fail(element, f"{whose} has an element <{element.tag}> without <{tag}>; add it")
        return child

    def text(self, element: Element, key: str, whose: str) -> str:
        """Attribute of a markup element that has to be there."""
        if not (value := element.attributes.get(key, "").strip()):
            self.fail(element, f"{whose} has a <{element.tag}> without {key}; add {key}=...")
        return value

    def numbers(self, element: Element, key: str, count: int, default: float | None, whose: str) -> tuple[float, ...]:
        """Numbers of a markup attribute; each is the default where it is missing."""
        if (written := element.attributes.get(key)) is None:
            if default is None:
                self.fail(element, f"{whose} has a <{element.tag}> without {key}; add {key}=...")
            return (default,) * count
        words = written.split()
        if len(words) != count or not all(_NUMBER.fullmatch(word) for word in words):
            wanted = "a number" if count == 1 else f"{count} numbers"
            self.fail(element, f'{whose} has {key}="{clean(written)}" in <{element.tag}>, which is not {wanted}')
        values = tuple(float(word) for word in words)
        if not all(math.isfinite(value) and abs(value) <= LARGEST for value in values):
            self.fail(element, f'{whose} has {key}="{clean(written)}" in <{element.tag}>; write finite numbers')
        return values

    def number(self, element: Element, key: str, default: float | None, whose: str) -> float:
        """Single number of a markup attribute."""
        return self.numbers(element, key, 1, default, whose)[0]


def clean(text: str) -> str:
    """Word of the markup for a sentence or a comment: one line, no control characters, short."""
    shown = "".join(letter if letter.isprintable() else " " for letter in text)
    return shown if len(shown) <= 80 else f"{shown[:77]}..."


def read_markup(path: str | PathLike[str]) -> Markup:
    """Read the markup of an XML file."""
    if reason := unreadable(path):
        raise ModelError(reason, path=str(path))
    try:
        if (size := Path(path).stat().st_size) > LARGEST_FILE:
            rest = (
                f"{size / 2**20:.0f} MB, and a robot is at most {LARGEST_FILE >> 20}; put shapes in files of their own"
            )
            raise ModelError(f"{path} has {rest}", path=str(path))
        content = Path(path).read_bytes()
    except FileNotFoundError:
        raise ModelError(f"{path} does not exist; check the path", path=str(path)) from None
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror or error}", path=str(path)) from error
    return parse_markup(content, str(path))


def parse_markup(content: bytes, path: str) -> Markup:
    """Parse the markup of an XML file's bytes."""
    open_elements: list[Element] = []
    roots: list[Element] = []
    parser = expat.ParserCreate()

    def fail(text: str) -> NoReturn:
        line = parser.CurrentLineNumber
        raise ModelError(f"{path}, line {line}: {text}", path=path, line=line)

    def begin(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) >= DEEPEST:
            fail(f"elements are nested more than {DEEPEST} deep; write them flatter")
        element = Element(tag, attributes, parser.CurrentLineNumber, parser.CurrentByteIndex)
        (open_elements[-1].children if open_elements else roots).append(element)
        open_elements.append(element)

    def end(_: str) -> None:
        open_elements.pop().close = parser.CurrentByteIndex

    def refuse(*_: object) -> NoReturn:
        fail(
            "a document type is declared, with which a file can fetch others or grow without end; remove <!DOCTYPE ...>"
        )

    parser.StartElementHandler = begin
    parser.EndElementHandler = end
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        what = expat.errors.messages.get(error.code, "it cannot be read")
        text = f"{path}, line {error.lineno}, column {error.offset + 1} is not XML: {what}; correct the line"
        raise ModelError(text, path=path, line=error.lineno, column=error.offset + 1) from None
    except ModelError:
        raise
    except (ValueError, LookupError) as error:
        raise ModelError(
            f"{path} is in an encoding that cannot be read ({error}); save it as UTF-8", path=path
        ) from None
    return Markup(path, content, roots[0])
