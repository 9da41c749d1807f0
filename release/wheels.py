"""Build wheels into dist/ and check them.

::

    python release/wheels.py             # manylinux2014 for x86-64 and aarch64, by zig, which knows old libraries
    python release/wheels.py --native    # for this machine, by its own linker

Each carries the number of its sources, see ``sources.py``. twine checks all of them, auditwheel the first two.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

from sources import ROOT, digest

TARGETS = ("x86_64-unknown-linux-gnu", "aarch64-unknown-linux-gnu")
DIST = ROOT / "dist"
STAMP = ROOT / "python" / "vpm" / "sources.txt"
#: Most bytes of a wheel.
LARGEST = 8_100_000
#: Least minor version of glibc that manylinux2014 promises.
GLIBC = 17


def python(*words: str) -> str:
    """Run a module of this interpreter; what it says goes on, and is given."""
    done = subprocess.run([sys.executable, "-m", *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    print(done.stdout, end="")
    if done.returncode:
        sys.exit(f"python -m {' '.join(words)} failed")
    return done.stdout


def has_library(target: str) -> bool:
    """Whether Rust can compile for a target here; its standard library is fetched where rustup can do it."""
    asked = ["rustc", "--print", "target-libdir", "--target", target]
    told = subprocess.run(asked, capture_output=True, text=True, check=False)
    if told.returncode == 0 and Path(told.stdout.strip()).is_dir():
        return True
    rustup = shutil.which("rustup")
    return rustup is not None and subprocess.run([rustup, "target", "add", target], check=False).returncode == 0


def build(*words: str) -> Path:
    """Wheel of the sources as they stand."""
    before, known = digest(), set(DIST.glob("*.whl"))
    STAMP.write_text(before + "\n", encoding="ascii")
    try:
        python("maturin", "build", "--release", "--compression-level", "9", "--out", str(DIST), *words)
    finally:
        STAMP.unlink()
    (wheel,) = set(DIST.glob("*.whl")) - known
    if digest() != before:
        wheel.unlink()
        sys.exit("the sources changed while the wheel was built from them; build it again")
    return wheel


def check(wheel: Path, *, many: bool) -> None:
    """Complain about a wheel that is too large, badly described, or asks for newer libraries than its name says."""
    python("twine", "check", "--strict", str(wheel))
    if many:
        told = re.search(r"manylinux_2_(\d+)_", python("auditwheel", "show", str(wheel)).split("platform tag", 1)[-1])
        if told is None or int(told[1]) > GLIBC:
            sys.exit(f"{wheel.name} needs newer system libraries than manylinux2014 has; see auditwheel above")
    size = wheel.stat().st_size
    if size > LARGEST:
        sys.exit(f"{wheel.name} has {size / 1e6:.1f} MB, more than {LARGEST / 1e6:.1f}; leave something out")
    print(f"{wheel.relative_to(ROOT)}: {size / 1e6:.2f} MB")


def main() -> None:
    """Build what the command line asks for."""
    for old in DIST.glob("*.whl"):
        old.unlink()
    if sys.argv[1:] == ["--native"]:
        check(build(), many=False)
        return
    missing = [target for target in TARGETS if not has_library(target)]
    for target in TARGETS:
        if target not in missing:
            check(build("--zig", "--compatibility", "manylinux2014", "--target", target), many=True)
    for target in missing:
        print(f"no wheel for {target}: Rust has no standard library for it here; run rustup target add {target}")
    if len(missing) == len(TARGETS):
        sys.exit(1)


if __name__ == "__main__":
    main()
