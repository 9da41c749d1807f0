"""Results for people: a short story for the terminal, ``report.json`` and a self-contained ``report.html``."""

from vpm.report.html import render_html
from vpm.report.story import print_story
from vpm.report.write import write_report

__all__ = ["print_story", "render_html", "write_report"]
