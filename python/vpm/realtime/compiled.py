"""Compiled models: one file with all that a step needs, for the C library and for Rust."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from numpy.typing import ArrayLike

from vpm.errors import SimulationError
from vpm.files import write_text
from vpm.model import Model
from vpm.simulate import AUTOMATIC, Setup

#: Version of the format; `crates/vpm-core/src/compiled.rs` reads it.
FORMAT = 1


@dataclass(frozen=True)
class CompiledModel:
    """A model with its parameters in one flat block, its start, and the way that time advances.

    Attributes
    ----------
    text : str
        What the file holds, JSON.
    inputs, outputs : tuple of str
        Names in the order in which the step takes and shows them.
    """

    name: str
    text: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def save(self, path: str | PathLike[str]) -> Path:
        """Save a compiled model to the file that ``vpm_open`` reads."""
        return write_text(path, self.text)


def compile_model(
    model: Model,
    rate: float,
    *,
    integrator: str = AUTOMATIC,
    substeps: int = 1,
    state: Mapping[str, float] | ArrayLike | None = None,
) -> CompiledModel:
    """Compile a model for callers without Python.

    Parameters
    ----------
    rate : float
        Samples per second, Hz.
    integrator, substeps
        See :class:`vpm.simulate.Setup`; ``auto`` takes steps whose time has a bound.
    state : mapping of str to float, or array_like of shape (nx,), optional
        Where it starts, as ``model.state`` takes it; what is not named is zero.

    Raises
    ------
    SimulationError, ModelError
        A setting or a name is wrong.
    """
    from vpm.stepping import Simulation

    if not rate > 0.0:
        raise SimulationError(f"a rate of {rate:g} Hz is not possible; give a positive number")
    setup = Setup(integrator, substeps)
    method = setup.method(model, bounded=True)
    # What a simulation refuses, a compiled model must not hold.
    simulation = Simulation(model, 1.0 / rate, integrator=method, substeps=substeps, state=state)
    description = json.loads(model.description())
    description["parameters"] = model.theta.tolist()
    content = {
        "format": FORMAT,
        "name": model.name,
        "time_step": 1.0 / rate,
        "substeps": substeps,
        "integrator": method,
        "inputs": list(model.inputs),
        "outputs": list(simulation.channels),
        "states": list(model.state_names),
        "start": simulation.state.tolist(),
        "description": description,
    }
    return CompiledModel(model.name, json.dumps(content, indent=1) + "\n", tuple(model.inputs), simulation.channels)
