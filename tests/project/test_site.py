"""Pages of the site: links that go where things stand there, and formulas."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

import vpm
from places import ROOT

sys.path.insert(0, str(ROOT / "docs" / "site"))

pages = import_module("pages")


def test_links_go_where_things_stand_on_the_site(tmp_path: Path) -> None:
    sources = {ROOT / "README.md": "index.md", ROOT / "docs" / "beams.md": "beams.md"}
    text = pages.moved(ROOT / "README.md", sources, tmp_path)
    assert "](beams.md" in text
    assert "](docs/beams.md" not in text
    assert "](files/examples/karl/run.py)" in text
    assert (tmp_path / "files" / "examples" / "karl" / "run.py").is_file()


def test_the_reference_has_every_public_function_and_class() -> None:
    text = pages.reference()
    for name in ("Model", "identify", "diagnose", "simulate_batch"):
        assert name in vpm.__all__
        assert f"      heading: vpm.{name}\n" in text


def test_formulas_are_set_but_code_is_not(tmp_path: Path) -> None:
    pytest.importorskip("latex2mathml", reason="latex2mathml, which sets the formulas of the site, is not installed")
    (tmp_path / "page.md").write_text(
        'mass $M \\ddot q$ and `$HOME`\n\n$$\\tau = M a$$\n\n```python\nx["a"](b)\necho = "$A $B"\n```\n',
        encoding="utf-8",
    )
    text = pages.moved(tmp_path / "page.md", {}, tmp_path)
    assert text.count("<math") == 2
    assert 'display="block"' in text
    assert "mass <span><math" in text  # inline also where a line begins with it
    assert "`$HOME`" in text
    assert 'x["a"](b)\necho = "$A $B"' in text
