"""Expand one xacro file to standard output: ``python -m vpm.robots.xacro_process FILE NAME:=VALUE...``.

Xacro evaluates expressions of Python. Those of a robot are arithmetic on its properties, so whatever reaches for the
inside of the interpreter is refused, and time and memory have an end.
"""

import ast
import sys
from collections.abc import Mapping
from typing import Any

#: Bytes of memory and seconds of a processor.
MEMORY, SECONDS = 1 << 31, 45


def harmless(expression: str) -> bool:
    """Whether a xacro expression reaches for no private name, and makes no function."""
    for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
        name = getattr(node, "attr", None) or getattr(node, "id", None) or ""
        if name.startswith("_") or isinstance(node, ast.Lambda) or name in {"format", "format_map"}:
            return False
    return True


def _limit() -> None:
    try:
        import resource
    except ImportError:  # Windows has none; the time is limited from outside
        return
    for what, most in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CPU, SECONDS)):
        resource.setrlimit(what, (most, most))


def main(path: str, arguments: Mapping[str, str]) -> str:
    """Text of the URDF into which a xacro file expands."""
    import xacro
    from xacrodoc import XacroDoc

    evaluate = xacro.safe_eval

    def careful(expression: str, *namespaces: Any) -> Any:  # noqa: ANN401
        if not harmless(expression):
            raise ValueError(f"what is no arithmetic is not run: {expression!r}")
        return evaluate(expression, *namespaces)

    xacro.safe_eval = careful
    return str(XacroDoc.from_file(path, subargs=dict(arguments), resolve_packages=False).to_urdf_string())


if __name__ == "__main__":
    _limit()
    try:
        given = dict(word.split(":=", 1) for word in sys.argv[2:])
        sys.stdout.buffer.write(main(sys.argv[1], given).encode())
    except MemoryError:
        sys.exit("it takes too much memory")
    except Exception as error:  # noqa: BLE001 - whatever xacro raises is told by the process that asked
        sys.exit(" ".join(str(error).split()) or type(error).__name__)
