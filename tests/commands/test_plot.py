"""Pictures: what is drawn, that it is readable text and no window, and that pages can hold it."""

import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from vpm import plot
from vpm.compare import compare
from vpm.compare.correlation import gapped_autocorrelation
from vpm.discrepancy.diagnosis import ChannelGap, Picture, RankedCandidate, Trace
from vpm.errors import MissingExtraError
from vpm.experiment import Experiment
from vpm.numbers import stretches
from vpm.plot import findings
from vpm.plot.evidence import law_line
from vpm.plot.signals import amplitude_density, running_mean
from vpm.plot.style import MOST_POINTS, plain_power, thinned
from vpm.simulate import Run

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.figure import Figure  # noqa: E402  # only where there is one

TIME = np.arange(600) / 100
WAVE = np.sin(2 * TIME)


RUN = Run(
    "slide",
    "log",
    "free_run",
    TIME,
    ("axis.position", "axis.velocity"),
    ("m", "m/s"),
    np.column_stack([WAVE, 2 * np.cos(2 * TIME)]),
    np.column_stack([WAVE + 0.1, np.full(600, np.nan)]),
    np.array([0, 300]),
)
GAP = ChannelGap(5.0, 2.0, 1.0, 0.3, "N", 10.0, "free_run")
PICTURE = Picture("axis.effort", "N", "m", TIME, WAVE, 2 * np.cos(2 * TIME), 5 * WAVE, 3 * WAVE, 2 * WAVE, WAVE)
TRACE = Trace("log", "axis.position", "m", "free_run", TIME, WAVE, 0.9 * WAVE, np.where(TIME < 1.0, np.nan, WAVE))

#: Residuals of a joint with dry friction, whose samples at standstill do not count.
HOLES = np.where(np.abs(2 * np.cos(2 * TIME)) < 0.3, np.nan, 0.5 * np.sign(np.cos(2 * TIME)) + 0.1 * np.sin(40 * TIME))

CANDIDATES = [
    RankedCandidate("coulomb_friction", "axis", 1, 0.5, 0.4, True),
    RankedCandidate("asymmetric_friction", "axis", 2, 0.5, 0.4, True),
    RankedCandidate("bias_force", "axis", 1, 0.5, float("nan"), False),
    RankedCandidate("stribeck_friction", "axis", 1, 0.7, 0.4, False),
]

FIGURES: dict[str, tuple[Callable[[], Figure], list[str]]] = {
    "channels": (
        lambda: plot.plot_channels(TIME, np.column_stack([WAVE, WAVE]), ["a", "b"], ["m", "1"], title="log"),
        ["time [s]", "[m]", "log", "a", "b"],
    ),
    "run": (
        lambda: plot.plot_run(RUN),
        ["time [s]", "[m]", "axis.position", "measured", "simulated", "slide on log, free run"],
    ),
    "traces": (
        lambda: findings.plot_traces([TRACE, replace(TRACE, channel="b.position")]),
        ["axis.position [m]", "b.position [m]", "time [s]", "measured", "simulated before", "simulated after"],
    ),
    "joint_over_time": (
        lambda: findings.plot_joint_over_time(PICTURE, {"recalibrated": HOLES, "with the effects": HOLES}),
        ["axis.effort [N]", "measured", "needed, recalibrated", "needed, with the effects", "residual [N]"],
    ),
    "joint_over_state": (
        lambda: findings.plot_joint_over_state(PICTURE, {"recalibrated": HOLES}),
        ["velocity [m/s]", "position [m]", "> forward, < backward", "recalibrated, mean"],
    ),
    "joint_noise": (
        lambda: findings.plot_joint_noise({"recalibrated": HOLES}, gapped_autocorrelation(HOLES, 0.01), 100.0, "N"),
        ["lag [s]", "95 % if independent", "frequency [Hz]", "density [N/√Hz]", "recalibrated"],
    ),
    "parameter_correlation": (
        lambda: findings.plot_parameter_correlation(["mass", "bias"], np.array([[1.0, -0.5], [-0.5, 1.0]])),
        ["mass  1", "bias  2", "1.00", "-0.50", "correlation"],
    ),
    "correlation": (
        lambda: plot.plot_correlation(TIME[:50], WAVE[:50], 0.1, "with itself"),
        ["lag [s]", "correlation", "with itself", "95 % if independent"],
    ),
    "parameters": (
        lambda: plot.plot_parameters(["mass", "bias"], [95.0, -3.0], [0.2, np.inf], [100.0, 0.0], ["kg", "N"]),
        ["mass", "bias", "95 ± 0.2 kg", "-3 ± inf N", "value / size of the start"],
    ),
    "gap": (
        lambda: plot.plot_gap({"axis.effort": GAP, "b.effort": replace(GAP, noise_floor=float("nan"), signal=0.0)}),
        ["axis.effort", "before", "recalibrated", "after", "noise floor", "50.00 %", "20.00 %", "10.00 %", "no signal"],
    ),
    "candidates": (
        lambda: plot.plot_candidates(CANDIDATES),
        ["coulomb friction at axis", "not refitted", "accepted, validation data", "refused, validation data"],
    ),
    "ladder": (
        lambda: plot.plot_ladder([1e-6, 2e-6], [0.3, 0.1], 1),
        ["time of one step [µs]", "error / signal [%]", "chosen", "tried"],
    ),
    "step_cost": (
        lambda: plot.plot_step_cost({"p50": 1e-6, "max": 1.2e-3}, 1e-3),
        ["p50", "max", "1 µs, 0.1 %", "1200 µs, 120 %", "period, 100 %"],
    ),
    "pictures": (
        lambda: plot.plot_pictures([PICTURE, replace(PICTURE, channel="b.effort")]),
        ["axis.effort", "b.effort", "velocity [m/s]", "position [m]", "before", "recalibrated", "with the effects"],
    ),
    "comparison": (
        lambda: plot.plot_comparison(compare(RUN, log())),
        ["slide against log, free run", "residual over time", "axis.velocity [m/s]", "measured", "simulated"],
    ),
}


def log() -> Experiment:
    return Experiment.from_arrays(TIME, {"axis.position": WAVE + 0.1}, {"axis.position": "m"}, "log")


def texts(figure: Figure) -> set[str]:
    """Everything that is written in a figure."""
    figure.draw_without_rendering()
    return {text.get_text() for text in figure.findobj(matplotlib.text.Text)}


@pytest.mark.parametrize("name", FIGURES)
def test_figures_say_what_they_show(name: str) -> None:
    make, expected = FIGURES[name]
    figure = make()
    assert isinstance(figure, Figure)
    written = texts(figure)
    assert [text for text in expected if text not in written] == []
    if "matplotlib.pyplot" in sys.modules:
        assert matplotlib.pyplot.get_fignums() == []  # no figure that somebody would have to close


@pytest.mark.parametrize("name", FIGURES)
def test_figures_become_svg_elements(name: str) -> None:
    figure = FIGURES[name][0]()
    svg = plot.figure_to_svg(figure)
    root = ET.fromstring(svg)
    assert root.tag.endswith("svg")
    ids = [element.attrib["id"] for element in root.iter() if "id" in element.attrib]
    assert len(ids) == len(set(ids))
    wanted = {
        value[1:] for e in root.iter() for key, value in e.attrib.items() if key.endswith("href") and value[:1] == "#"
    }
    wanted |= {v[5:-1] for e in root.iter() for v in e.attrib.values() if v.startswith("url(#")}
    assert wanted <= set(ids)
    assert plot.figure_to_svg(FIGURES[name][0]()) == svg
    assert "dc:date" not in svg


def test_svg_names_of_two_figures_do_not_meet() -> None:
    one, two = (plot.figure_to_svg(FIGURES[name][0]()) for name in ("gap", "ladder"))
    ids = [{e.attrib["id"] for e in ET.fromstring(svg).iter() if "id" in e.attrib} for svg in (one, two)]
    assert ids[0].isdisjoint(ids[1])


def test_only_measured_channels_of_a_run_are_drawn() -> None:
    assert len(plot.plot_run(RUN).axes) == 1
    nothing = replace(RUN, measured=np.full((600, 2), np.nan))
    assert len(plot.plot_run(nothing).axes) == 2
    # Two pieces, measured and simulated: four lines, none across the restart.
    lines = plot.plot_run(RUN).axes[0].get_lines()
    assert [len(np.asarray(line.get_xdata())) for line in lines] == [300, 300, 300, 300]


def test_results_draw_themselves() -> None:
    assert len(log().plot().axes) == 1
    assert len(compare(RUN, log()).plot().axes) == 3


def test_an_accepted_candidate_of_a_later_round_is_drawn_and_others_are_not() -> None:
    later = [*CANDIDATES, RankedCandidate("torque_ripple", "axis", 2, 0.5, 0.4, False)]
    written = texts(plot.plot_candidates(later))
    assert "asymmetric friction at axis" in written
    assert "torque ripple at axis" not in written
    assert len(plot.plot_candidates([]).axes) == 1


def test_thinning_keeps_every_peak() -> None:
    time = np.arange(200_000.0)
    values = np.random.default_rng(0).standard_normal(200_000)
    values[123_456] = 50.0
    kept, shown = thinned(time, values)
    assert kept.size <= MOST_POINTS + 200
    assert shown.max() == 50.0
    assert shown.min() == values.min()
    assert np.all(np.diff(kept) > 0)
    short = thinned(time[:10], values[:10])
    np.testing.assert_array_equal(short[1], values[:10])


def test_running_mean_leaves_gaps_open() -> None:
    values = np.concatenate([np.linspace(0, 1, 500), np.linspace(3, 4, 500)])
    centers, means = running_mean(values, 2.0 * values)
    filled = np.isfinite(means)
    assert not filled[(centers > 1.1) & (centers < 2.9)].any()
    np.testing.assert_allclose(means[filled], 2.0 * centers[filled], atol=0.1)


def test_a_step_of_dry_friction_stays_a_step() -> None:
    """Means of forward and backward motion are apart, and no bin of a law reaches over zero velocity."""
    velocity = np.random.default_rng(0).uniform(-1.0, 1.0, 400)
    residual = 0.5 * np.sign(velocity)
    figure = findings.plot_joint_over_state(replace(PICTURE, position=velocity, velocity=velocity), {"a": residual})
    means = [line for line in figure.axes[0].get_lines() if line.get_marker() in {">", "<"}]
    assert len(means) == 2
    for line, side in zip(means, (0.5, -0.5), strict=True):
        drawn = np.asarray(line.get_ydata(), dtype=np.float64)
        np.testing.assert_allclose(drawn[np.isfinite(drawn)], side)
    order = np.sort(velocity)
    _, levels, _ = law_line(order, 0.5 * np.sign(order))
    assert set(np.round(levels, 12)) == {-0.5, 0.5}


def test_samples_that_do_not_count_are_neither_drawn_nor_averaged() -> None:
    holes = np.where(np.arange(50_000) % 1000 < 300, np.nan, 2.0)
    _, kept = thinned(np.arange(50_000.0), holes)
    assert kept.size <= 2 * MOST_POINTS
    assert np.isnan(kept).any()
    assert np.nanmin(kept) == np.nanmax(kept) == 2.0
    _, means = running_mean(np.linspace(0.0, 1.0, holes.size), holes)
    np.testing.assert_allclose(means[np.isfinite(means)], 2.0)
    centers, _ = running_mean(np.zeros(3), np.full(3, np.nan))
    assert centers.size == 0


def test_stretches_are_contiguous() -> None:
    counts = np.array([False, True, True, False, True])
    assert stretches(counts) == [slice(1, 3), slice(4, 5)]
    assert stretches(~counts) == [slice(0, 1), slice(3, 4)]
    assert stretches(np.zeros(0, np.bool_)) == []


def test_spectra_and_correlations_do_not_see_gaps() -> None:
    """A sine is found at its frequency with its power, and white noise is white, whatever stretches are missing."""
    random = np.random.default_rng(1)
    time = np.arange(20_000) / 100.0
    away = (np.arange(time.size) // 700) % 3 == 1
    sine = np.where(away, np.nan, np.sqrt(2.0) * np.sin(2.0 * np.pi * 12.5 * time))
    frequency, density = amplitude_density(sine, 100.0)
    assert frequency[np.argmax(density)] == pytest.approx(12.5, abs=0.3)
    assert np.sum(density**2) * (frequency[1] - frequency[0]) == pytest.approx(1.0, rel=0.02)
    noise = np.where(away, np.nan, random.standard_normal(time.size))
    lags, values, band = gapped_autocorrelation(noise, 0.01)
    assert values[0] == pytest.approx(1.0)
    assert lags[1] == 0.01
    assert np.mean(np.abs(values[1:]) > band[1:]) < 0.12
    assert gapped_autocorrelation(np.full(5, np.nan), 0.01)[0].size == 0


def test_powers_of_ten_are_letters() -> None:
    assert plain_power(r"$\mathdefault{2\times10^{-3}}$") == "2×10⁻³"
    assert plain_power(r"$\mathdefault{10^{12}}$") == "10¹²"
    assert plain_power("plain") == "plain"
    figure = FIGURES["joint_noise"][0]()
    assert "mathdefault" not in plot.figure_to_svg(figure)


def test_words_of_a_picture_stand_in_its_svg() -> None:
    svg = plot.figure_to_svg(FIGURES["gap"][0](), 'errors of "a" < 5 %')
    root = ET.fromstring(svg)
    assert root.attrib["role"] == "img"
    assert root.attrib["aria-label"] == 'errors of "a" < 5 %'
    assert any("50.00 %" in "".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text"))


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in [name for name in sys.modules if name.partition(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtraError, match=r'pip install "vpm-dynamics\[plot\]"'):
        plot.plot_ladder([1e-6], [0.1], 0)
    with pytest.raises(MissingExtraError, match="matplotlib"):
        log().plot()
