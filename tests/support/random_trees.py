"""Random machines: trees of bodies on joints of any type, and of beams."""

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st

from vpm.model.beams.level import COMPONENTS, FORMS

sizes = st.floats(1e-3, 0.1)


@st.composite
def trees(draw: st.DrawFn) -> dict[str, Any]:
    """Content of a model file: a tree of bodies on joints of any type and of beams, in any order."""
    count = draw(st.integers(1, 6))
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    beams: dict[str, Any] = {}
    standing: list[str] = ["world"]
    for k in range(count):
        parent = draw(st.sampled_from(standing))
        where: dict[str, Any] = {"parent": parent}
        if parent in beams and draw(st.booleans()):
            where["at"] = draw(st.floats(0.0, beams[parent]["length"]))
        where["translation"] = draw(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3))
        where["rotation"] = draw(st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3))
        if draw(st.booleans()):
            name = f"beam{k}"
            beams[name] = where | draw(beam_tables())
        else:
            name = f"body{k}"
            bodies[name] = {"mass": draw(sizes), "inertia": [0.1, 0.1, 0.1, 0.0, 0.0, 0.0]}
            joints[f"joint{k}"] = where | {"child": name} | draw(joint_tables(fixed=k > 0))
        standing.append(name)
    content: dict[str, Any] = {"name": "tree", "gravity": [0.0, 0.0, -9.81]}
    for key, table in (("bodies", bodies), ("joints", joints), ("beams", beams)):
        if table:
            content[key] = dict(draw(st.permutations(list(table.items()))))
    return content


@st.composite
def joint_tables(draw: st.DrawFn, *, fixed: bool) -> dict[str, Any]:
    """A joint of any type; of one that moves, unless `fixed` ones are allowed."""
    moving = ["prismatic", "revolute", "helical", "cylindrical", "planar", "spherical", "free"]
    kind = draw(st.sampled_from([*moving, "fixed"] if fixed else moving))
    table: dict[str, Any] = {"type": kind}
    if kind not in {"spherical", "free", "fixed"}:
        axis = np.array(draw(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: math.hypot(*a) > 0.1)))
        table["axis"] = (axis / np.linalg.norm(axis)).tolist()
    if kind == "helical":
        table["pitch"] = draw(sizes)
    return table


@st.composite
def beam_tables(draw: st.DrawFn) -> dict[str, Any]:
    name = draw(st.sampled_from(["rigid", *(form for form in FORMS if form != "reduced")]))
    level = name if name == "rigid" else f"{name}({draw(st.integers(FORMS[name].least, 5))})"
    length, inner, wall = draw(st.floats(0.1, 2.0)), draw(sizes), draw(sizes)
    shape = st.sampled_from(
        [
            {"shape": "rectangle", "width": inner, "height": wall},
            {"shape": "circle", "diameter": wall},
            {"shape": "tube", "inner": inner, "outer": inner + wall},
        ]
    )
    section = draw(shape)
    several = {"sections": [{"at": 0.0, **section}, {"at": length, **section}]}
    return {
        "length": length,
        "level": level,
        "deforms": draw(st.lists(st.sampled_from(COMPONENTS), min_size=1, max_size=6, unique=True)),
        "material": {"young": {"value": 70.0, "unit": "GPa", "uncertainty": 1.0}, "density": 2700.0},
        **(several if draw(st.booleans()) else {"section": section}),
        "damping": {"ratios": draw(st.lists(st.floats(0.0, 0.1), max_size=3))},
    }
