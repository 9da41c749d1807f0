"""Gathers the pages of the site: documents, pictures, reference. Their order is in `mkdocs.yml`.

python docs/site/pages.py FOLDER [--without-gallery]
"""

from __future__ import annotations

import argparse
import inspect
import re
import shutil
import subprocess
import sys
from pathlib import Path

import vpm

ROOT = Path(__file__).resolve().parent.parent.parent
DOCS = ROOT / "docs"

#: Pages that stand beside the documents.
BESIDE = {
    "README.md": "index.md",
    "ARCHITECTURE.md": "architecture.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
#: Examples that draw: a folder each, with a script that takes the folder of its pictures.
EXAMPLES = ("flexible_pendulum", "spinning_beam", "servo_cylinder", "karl", "hyq_leg", "tudor")

#: Code has no links and no formulas.
_CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)
_FORMULA = re.compile(r"\$\$(?P<displayed>.+?)\$\$|\$(?P<inline>[^$\n]+?)\$", re.DOTALL)
_LINK = re.compile(r"(\]\(|src=\"|href=\")(?!https?:|mailto:|#)([^)#\"\s]+)")


def gather(folder: Path, *, gallery: bool) -> None:
    """Write all pages into ``folder``, which is made anew."""
    shutil.rmtree(folder, ignore_errors=True)
    sources = {DOCS / path.name: path.name for path in DOCS.glob("*.md") if path.name != "index.md"}
    sources |= {ROOT / name: target for name, target in BESIDE.items()}
    folder.mkdir(parents=True)
    for source, target in sources.items():
        (folder / target).write_text(moved(source, sources, folder), encoding="utf-8")
    (folder / "gallery.md").write_text(pictures(folder) if gallery else "# Gallery\n", encoding="utf-8")
    (folder / "api.md").write_text(reference(), encoding="utf-8")


def moved(page: Path, sources: dict[Path, str], folder: Path) -> str:
    """A page with its links to where things stand on the site; what is no page is copied beside the pages."""

    def link(found: re.Match[str]) -> str:
        goal = (page.parent / found[2]).resolve()
        if goal == DOCS / "index.md":
            goal = ROOT / "README.md"
        target = sources.get(goal)
        if target is None:
            target = f"files/{goal.relative_to(ROOT).as_posix()}"
            copy(goal, folder / target)
        return found[1] + target

    parts = _CODE.split(page.read_text(encoding="utf-8"))
    return "".join(part if number % 2 else set_formulas(_LINK.sub(link, part)) for number, part in enumerate(parts))


def set_formulas(text: str) -> str:
    """Formulas between dollar signs as MathML, which browsers set without a script."""
    if not _FORMULA.search(text):
        return text
    from latex2mathml.converter import convert

    def formula(found: re.Match[str]) -> str:
        displayed = found["displayed"]
        if displayed:
            return f"<p>{convert(displayed.strip(), display='block')}</p>"
        # A line that begins with <math> would be taken for a block of its own.
        return f"<span>{convert(found['inline'].strip())}</span>"

    return _FORMULA.sub(formula, text)


def copy(source: Path, target: Path) -> None:
    """Copy a file or a folder; what does not exist is left to the check of links."""
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, dirs_exist_ok=True)
    elif source.is_file():
        shutil.copy2(source, target)


def pictures(folder: Path) -> str:
    """The gallery, with pictures that the examples draw now."""
    page = ["# Gallery", "", "Every picture is drawn by the example beside it when this site is made.", ""]
    for name in EXAMPLES:
        script, own = ROOT / "examples" / name / "run.py", folder / "gallery" / name
        own.mkdir(parents=True)
        subprocess.run([sys.executable, script, own], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)  # noqa: S603
        title = script.read_text(encoding="utf-8").split('"""', 2)[1].strip().splitlines()[0]
        head, _, rest = title.partition(": ")
        page += [f"## {head}", "", (rest or head)[:1].upper() + (rest or head)[1:], ""]
        drawn = sorted(own.glob("*.png")) + sorted(own.glob("*.svg"))
        page += [f"![{head}, {path.stem.replace('_', ' ')}](gallery/{name}/{path.name})\n" for path in drawn]
        page += [f"```console\n$ python examples/{name}/run.py plots\n```", ""]
    return "\n".join(page)


def reference() -> str:
    """All public functions and classes, in alphabetical order, each under the name that users write."""
    page = ["# Reference", "", "All that `import vpm` gives. Help texts of the command line: `vpm COMMAND --help`.", ""]
    for name in sorted(vpm.__all__, key=str.lower):
        thing = getattr(vpm, name)
        if inspect.isclass(thing) or inspect.isfunction(thing):
            home = f"{inspect.unwrap(thing).__module__}.{thing.__qualname__}"
            page += [f"::: {home}", "    options:", f"      heading: vpm.{name}", f"      toc_label: {name}", ""]
    return "\n".join(page)


def main() -> None:
    """Gather the pages that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--without-gallery", action="store_true", help="no example runs")
    chosen = parser.parse_args()
    gather(chosen.folder, gallery=not chosen.without_gallery)


if __name__ == "__main__":
    main()
