"""The demo: a model file, two records of a machine that differs from it, and the way to what the difference is.

The files stand in `FOLDER`; ``README.md`` there tells what they are, and `vpm.demo.generate` makes them.
"""

from vpm.demo.story import FOLDER, MODEL, TRAIN, TRUTH, VALIDATION, print_list, run_demo

__all__ = ["FOLDER", "MODEL", "TRAIN", "TRUTH", "VALIDATION", "print_list", "run_demo"]
