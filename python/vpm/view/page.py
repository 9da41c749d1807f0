"""A scene as one static page: it holds all it needs and opens from a file, without a server and without a network."""

import base64
import html
import json
from dataclasses import asdict
from importlib.resources import files
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from vpm.files import write_text
from vpm.view.looks import GROUND, INK, LOOKS, SOFT
from vpm.view.scene import Arrow, Box, Scene, Shape, Sphere, Tube

#: Bytes of text that the places may take, and samples that an eye tells apart.
ROOM, MOST = 1_400_000, 1500
#: Share of the picture's height for the machine at first; the rest is for words and controls.
STAGE = 0.78


def write_page(scene: Scene, path: str | PathLike[str]) -> Path:
    """Write the page of a scene."""
    return write_text(path, page_of(scene))


def page_of(scene: Scene) -> str:
    """The page as text (HTML)."""
    # No bracket of the content ends the script that it stands in.
    content = json.dumps(_content(scene), allow_nan=False).replace("<", "\\u003c")
    player = files("vpm.view").joinpath("player.html").read_text(encoding="utf-8")
    script = files("vpm.view").joinpath("player.js").read_text(encoding="utf-8")
    title = html.escape(f"{scene.title}: {scene.subtitle}")
    return player.replace("<!--title-->", title).replace("/*player*/", script).replace("/*scene*/", content)


def _content(scene: Scene) -> dict[str, Any]:
    moving = sum(shape.points.shape[1] for shape in scene.shapes if len(shape.points) > 1)
    # Three numbers of two bytes each, in four letters for three bytes.
    kept = list(scene.frames(max(2, min(MOST, ROOM // (8 * max(moving, 1))))))
    centre, radius = scene.bounds
    reach = max([radius, *(float(np.max(np.abs(shape.points - centre))) for shape in scene.shapes)])
    parts, shapes, first = [], [], 0
    for shape in scene.shapes:
        points = shape.points[kept] if len(shape.points) > 1 else shape.points
        parts.append(np.rint((points - centre) / reach * 32767.0).astype("<i2").ravel())
        shapes.append({**_form(shape), "first": first, "samples": len(points), "count": points.shape[1]})
        first += points.size
    numbers = np.concatenate(parts) if parts else np.zeros(0, "<i2")
    return {
        "title": scene.title,
        "subtitle": scene.subtitle,
        "notes": list(scene.notes),
        "time": np.round(scene.time[kept], 6).tolist(),
        "up": scene.up.tolist(),
        "front": scene.front.tolist(),
        "centre": centre.tolist(),
        "radius": radius,
        "reach": reach,
        "stage": STAGE,
        "scales": dict(scene.scales),
        "grid": scene.grid,
        "looks": {role: asdict(LOOKS[role]) for role in LOOKS if role in scene.roles},
        "ground": asdict(GROUND),
        "ink": asdict(INK),
        "soft": asdict(SOFT),
        "shapes": shapes,
        "places": base64.b64encode(numbers.tobytes()).decode("ascii"),
    }


def _form(shape: Shape) -> dict[str, Any]:
    common = {"role": shape.role, "name": shape.name}
    match shape:
        case Tube():
            return {**common, "form": "tube", "radius": [round(float(r), 6) for r in shape.radius]}
        case Sphere():
            return {**common, "form": "sphere", "radius": round(shape.radius, 6)}
        case Box():
            return {**common, "form": "box"}
        case Arrow():
            return {**common, "form": "arrow", "radius": round(shape.radius, 6)}
    raise TypeError(f"no form of {type(shape).__name__}")
