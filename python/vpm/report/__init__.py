"""Results for people: a short story for the terminal, ``report.json`` and a self-contained ``report.html``."""

from vpm.report.html import Report, render_html, report, write_report
from vpm.report.story import print_story

__all__ = ["Report", "print_story", "render_html", "report", "write_report"]
