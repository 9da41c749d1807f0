"""Where the demo's files stand."""

from pathlib import Path

FOLDER = Path(__file__).parent
"""The folder that holds the demo's files."""

MODEL = FOLDER / "model.toml"
"""What the machine's builder believes: rough values, and one effect missing."""

TRAIN = FOLDER / "train.csv"
"""The record that the diagnosis learns from."""

VALIDATION = FOLDER / "validation.csv"
"""Another motion of the same machine, for checking on validation data."""

TRUTH = FOLDER / "truth.toml"
"""The hidden effect and the true values. Only shown at the end, never read by the diagnosis."""
