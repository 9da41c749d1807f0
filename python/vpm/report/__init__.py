"""Results for people: a short story for the terminal, ``report.json`` and a self-contained ``report.html``."""

from vpm.report.html import Report, render_html, report
from vpm.report.story import print_story
from vpm.report.write import write_report

__all__ = ["Report", "print_story", "render_html", "report", "write_report"]
