"""Pictures of results. Needs the extra ``plot``; each function returns a matplotlib figure and opens no window."""

from vpm.plot.bars import plot_candidates, plot_climb, plot_gap, plot_ladder, plot_parameters, plot_step_cost
from vpm.plot.evidence import plot_evidence
from vpm.plot.inertial import plot_inertial
from vpm.plot.linear import plot_bode, plot_poles
from vpm.plot.narx import plot_narx_run, plot_narx_terms
from vpm.plot.scenarios import plot_scenario
from vpm.plot.signals import plot_channels, plot_correlation, plot_run
from vpm.plot.style import figure_to_svg
from vpm.plot.summaries import plot_comparison, plot_pictures

__all__ = [
    "figure_to_svg",
    "plot_bode",
    "plot_candidates",
    "plot_channels",
    "plot_climb",
    "plot_comparison",
    "plot_correlation",
    "plot_evidence",
    "plot_gap",
    "plot_inertial",
    "plot_ladder",
    "plot_narx_run",
    "plot_narx_terms",
    "plot_parameters",
    "plot_pictures",
    "plot_poles",
    "plot_run",
    "plot_scenario",
    "plot_step_cost",
]
