"""``python -m fuzz.seeds FOLDER`` in the folder of the tests: what the fuzzer of the Rust targets begins with."""

import json
import sys
from pathlib import Path

from fuzz.doors import MODELS, described
from vpm.errors import VpmError

if __name__ == "__main__":
    for name in MODELS:
        try:
            compiled = described(name)
        except VpmError:  # a machine that does not stand with all coordinates at zero
            continue
        texts = {"compiled": compiled, "c_interface": compiled, "description": compiled["description"]}
        for target, content in texts.items():
            folder = Path(sys.argv[1]) / target
            folder.mkdir(parents=True, exist_ok=True)
            text = json.dumps(content, separators=(",", ":"))
            (folder / f"{name.replace('/', '_')}.json").write_text(text, encoding="utf-8")
