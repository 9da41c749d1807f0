"""What several test files share."""

import os
import signal
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import settings

from limits import Limits
from shared_cases import FOLDER
from vpm.model import Model

# Generous time for slow machines; failing examples are printed in a form that can be pasted. Where the variable CI is
# set, the same code is always tried on the same examples, so that a change is judged by what it does and not by luck;
# everywhere else every run draws new ones.
settings.register_profile("vpm", deadline=None, print_blob=True, derandomize="CI" in os.environ)
settings.load_profile("vpm")

# A shell without job control starts background work (`make test &`, `nohup`) deaf to Ctrl-C, and every child would
# inherit that, the programs that tests interrupt among them.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# What one process of a run has made for tests, the others find here.
if "PYTEST_XDIST_WORKER" not in os.environ:
    _share = tempfile.TemporaryDirectory(prefix="vpm-tests-")
    os.environ[FOLDER] = _share.name


def pytest_configure(config: pytest.Config) -> None:
    if sys.platform == "linux":  # reads /proc
        config.pluginmanager.register(Limits(), "limits")


ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def emps() -> Model:
    """The model of the example EMPS drive."""
    return Model.load(ROOT / "examples" / "emps" / "model.toml")
