"""What users may rely on: every name of `vpm`, with the arguments of functions and the public members of classes.

python tests/support/public_api.py    writes tests/support/public_api.txt anew, from the package
"""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import ModuleType

import vpm

LIST = Path(__file__).with_suffix(".txt")


def lines() -> list[str]:
    """One line for each function, class, public member and module."""
    return [line for name in sorted(vpm.__all__) for line in _told(name, getattr(vpm, name))]


def _told(name: str, value: object) -> Iterator[str]:
    if inspect.isclass(value):
        yield f"class {name}"
        own = {field.name for field in fields(value)} if is_dataclass(value) else set[str]()
        for member in sorted(own | set(dir(value))):
            if not member.startswith("_") and not hasattr(Exception, member):
                yield f"{name}.{_member(value, member)}"
    elif callable(value):
        yield f"def {name}{_arguments(value)}"
    elif isinstance(value, ModuleType):
        yield f"module {name}: {', '.join(sorted(value.__all__))}"
    else:
        yield f"value {name}"


def _member(owner: type, name: str) -> str:
    value = inspect.getattr_static(owner, name, None)
    if isinstance(value, staticmethod | classmethod):
        value = value.__func__
    return f"{name}{_arguments(value)}" if inspect.isfunction(value) else name


def _arguments(value: Callable[..., object]) -> str:
    """Names and kinds of arguments, those with a default marked by dots: types and defaults may become wider."""
    empty = inspect.Parameter.empty
    listed = inspect.signature(value).parameters.values()
    kept = [one.replace(annotation=empty, default=empty if one.default is empty else ...) for one in listed]
    return str(inspect.Signature(kept)).replace("Ellipsis", "...")


if __name__ == "__main__":
    LIST.write_text("\n".join(lines()) + "\n", encoding="utf-8")
