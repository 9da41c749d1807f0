"""Formulas between dollar signs become MathML, which browsers set without a script."""

import re
from typing import Any

from latex2mathml.converter import convert

#: Code keeps its dollar signs.
_CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)
_DISPLAYED, _INLINE = re.compile(r"\$\$(.+?)\$\$", re.DOTALL), re.compile(r"\$([^$\n]+?)\$")


def on_page_markdown(markdown: str, **_: Any) -> str:  # noqa: ANN401  what the builder of the site hands over
    """Set the formulas of a page."""
    parts = _CODE.split(markdown)
    return "".join(part if number % 2 else set_formulas(part) for number, part in enumerate(parts))


def set_formulas(text: str) -> str:
    """Set the formulas of a text without code."""
    text = _DISPLAYED.sub(lambda found: convert(found[1].strip(), display="block"), text)
    return _INLINE.sub(lambda found: convert(found[1].strip()), text)
