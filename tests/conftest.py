"""What several test files share."""

from pathlib import Path

import pytest
from hypothesis import settings

from vpm.model import Model

# Generous time for slow machines; failing examples are printed in a form that can be pasted.
settings.register_profile("vpm", deadline=None, print_blob=True)
settings.load_profile("vpm")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def emps() -> Model:
    """The model of the example EMPS drive."""
    return Model.load(ROOT / "examples" / "emps" / "model.toml")
