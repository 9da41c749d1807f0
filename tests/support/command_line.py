"""A command as a user types it, but in this process: starting one takes longer than most commands."""

import sys
from collections.abc import Sequence
from contextlib import chdir, nullcontext, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from subprocess import CompletedProcess
from unittest.mock import patch

from vpm.cli import main


def vpm(*words: str | Path, cwd: Path | None = None) -> CompletedProcess[str]:
    """Exit code and what was said."""
    typed: Sequence[str] = ["vpm", *map(str, words)]
    out, err = StringIO(), StringIO()
    code: str | int | None = 0
    there = chdir(cwd) if cwd else nullcontext()
    with patch.object(sys, "argv", typed), there, redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            code = end.code
    return CompletedProcess(typed, int(code or 0), out.getvalue(), err.getvalue())


def ran(*words: str | Path, cwd: Path | None = None) -> CompletedProcess[str]:
    """What was said by a command that does what it should."""
    done = vpm(*words, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done
