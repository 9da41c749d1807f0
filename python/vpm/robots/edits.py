"""Numbers of attributes written into a file of XML, with every other byte as it was."""

import re
from dataclasses import dataclass, field

from vpm.robots.markup import Element, Markup

_ATTRIBUTE = re.compile(rb"""\s([^\s=<>/"']+)\s*=\s*("[^"]*"|'[^']*')""")
_TAG = re.compile(rb"""<[^\s/>]+(?:[^>"']|"[^"]*"|'[^']*')*>""")

Numbers = tuple[float, ...]
#: New and old numbers by attribute.
Changes = dict[str, tuple[Numbers, Numbers]]
#: Numbers that differ by less than this share are the same number after another way of rounding.
ROUNDING = 1e-14


@dataclass
class Edits:
    """Changes of a file, by the bytes that they take the place of."""

    markup: Markup
    changes: list[tuple[int, int, bytes]] = field(default_factory=list)

    def numbers(self, element: Element, key: str, new: Numbers, old: Numbers, size: float = 0.0) -> bool:
        """Edit an attribute where its numbers differ beyond rounding; whether it was written."""
        size = max(size, *(abs(value) for value in (*new, *old)))
        if all(abs(one - other) <= ROUNDING * size for one, other in zip(new, old, strict=True)):
            return False
        written = " ".join(_written(one) for one in new).encode()
        start, stop = self._tag(element)
        tag = self.markup.content[start:stop]
        for found in _ATTRIBUTE.finditer(tag):
            if found[1] == key.encode():
                self.changes.append((start + found.start(2) + 1, start + found.end(2) - 1, written))
                return True
        end = stop - (2 if tag.endswith(b"/>") else 1)
        while self.markup.content[end - 1 : end].isspace():
            end -= 1
        self.changes.append((end, end, b' %s="%s"' % (key.encode(), written)))
        return True

    def put(
        self,
        parent: Element,
        element: Element | None,
        tag: str,
        values: Changes,
        size: float = 0.0,
    ) -> None:
        """Edit attributes of a child, by key new and old numbers; make the child where it is not there."""
        if element is not None:
            for key, (new, old) in values.items():
                self.numbers(element, key, new, old, size)
        elif any(new != old for new, old in values.values()):
            written = "".join(f' {key}="{" ".join(map(_written, new))}"' for key, (new, _) in values.items())
            self._insert(parent, f"<{tag}{written}/>".encode())

    def _tag(self, element: Element) -> tuple[int, int]:
        found = _TAG.match(self.markup.content, element.start)
        if found is None:
            self.markup.fail(element, f"<{element.tag}> cannot be found in the bytes of the file; save it as UTF-8")
        return found.start(), found.end()

    def _empty(self, element: Element) -> bool:
        start, stop = self._tag(element)
        return self.markup.content[start:stop].endswith(b"/>")

    def _insert(self, parent: Element, written: bytes) -> None:
        """Edit in a child behind the last one, with the blanks that stand before that."""
        if not parent.children:
            start, stop = self._tag(parent)
            if self._empty(parent):  # it gets a last tag
                rest = b">" + written + b"</" + parent.tag.encode() + b">"
                self.changes.append((stop - 2, stop, rest))
            else:
                self.changes.append((stop, stop, written))
            return
        last = parent.children[-1]
        start, stop = self._tag(last)
        if not self._empty(last):
            stop = self.markup.content.index(b">", last.close) + 1
        before = self.markup.content[:start]
        blanks = before[len(before.rstrip(b" \t\r\n")) :]
        self.changes.append((stop, stop, blanks + written))

    def content(self) -> bytes:
        """Content of the file with its edits."""
        content = self.markup.content
        for start, stop, written in sorted(self.changes, key=lambda change: change[0], reverse=True):
            content = content[:start] + written + content[stop:]
        return content


def _written(value: float) -> str:
    """Shortest digits of an edited number that read back as the same; -0 is 0."""
    return repr(float(value) + 0.0)
