"""Model files as text: the same file with a few words changed, and what of a model reaches the core."""

import json
from typing import Any

from vpm.model import Model


def changed(text: str, *changes: tuple[str, str]) -> Model:
    """Model of a file in which each old text, which has to be there, stands once replaced by a new one."""
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return Model.from_toml(text)


def described(model: Model) -> Any:
    """Description that the core reads."""
    return json.loads(model.description())
