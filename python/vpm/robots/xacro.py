"""Xacro files, expanded by the program of their own in a process that can do nothing but that."""

import importlib.util
import subprocess
import sys
from collections.abc import Mapping

from vpm.errors import MissingExtraError, ModelError
from vpm.robots.markup import Markup, clean, parse_markup

#: Time that an expansion may take, s; those of large robots take one.
PATIENCE = 60.0


def is_xacro(markup: Markup) -> bool:
    """Whether a robot file is xacro and has to be expanded."""
    return markup.path.endswith(".xacro") or any("xacro" in key for key in markup.root.attributes)


def expanded(markup: Markup, arguments: Mapping[str, str]) -> Markup:
    """The URDF that a xacro file stands for."""
    for package in ("xacrodoc", "xacro"):
        if importlib.util.find_spec(package) is None:
            raise MissingExtraError(package, "robots")
    words = [f"{name}:={value}" for name, value in arguments.items()]
    command = [sys.executable, "-m", "vpm.robots.xacro_process", markup.path, *words]
    try:
        done = subprocess.run(command, capture_output=True, timeout=PATIENCE, check=False)  # noqa: S603
    except subprocess.TimeoutExpired:
        rest = f"it takes more than {PATIENCE:g} s to expand; it may call itself without end"
        raise ModelError(f"{markup.path}: {rest}", path=markup.path) from None
    if done.returncode:
        lines = [line for line in done.stderr.decode("utf-8", "replace").splitlines() if line.strip()]
        what = clean(lines[-1].strip() if lines else "its process ended")
        raise ModelError(f"{markup.path} cannot be expanded by xacro ({what}); correct the file", path=markup.path)
    return parse_markup(done.stdout, markup.path)
