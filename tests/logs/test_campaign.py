"""Campaigns: several records as one, divided by whole records or by time."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import vpm
from vpm.demo import MODEL, TRAIN, VALIDATION
from vpm.errors import ExperimentError
from vpm.experiment import Campaign, Experiment
from vpm.experiment.grid import FEWEST_SAMPLES


def record(name: str, samples: int = 200, rate: float = 100.0, *, start: float = 0.0, unit: str = "m") -> Experiment:
    time = start + np.arange(samples) / rate
    return Experiment.from_arrays(time, {"axis.position": np.sin(time)}, {"axis.position": unit}, name)


def write(path: Path, header: str = "time,axis.position [mm],u", rows: int = 20, step: float = 0.01) -> Path:
    path.parent.mkdir(exist_ok=True)
    columns = header.count(",")
    lines = [",".join([repr(step * k), *[str(k + c) for c in range(columns)]]) for k in range(rows)]
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return path


def test_a_campaign_is_a_sequence_that_knows_names() -> None:
    campaign = Campaign((record("a"), record("b", 400, 200.0), record("c")))
    assert len(campaign) == 3
    assert [r.name for r in campaign] == ["a", "b", "c"] == list(campaign.names)
    assert campaign["b"] is campaign[1]
    assert campaign[1:].names == ("b", "c")
    assert campaign.duration == pytest.approx(1.99 + 1.995 + 1.99)
    assert "\n" not in repr(campaign)
    assert "'a', 'b', 'c'" in repr(campaign)
    assert "400 samples" in campaign._repr_html_()
    assert list(campaign.to_frame()["rate_Hz"]) == pytest.approx([100.0, 200.0, 100.0])
    with pytest.raises(ExperimentError, match=r'no record "bb"; did you mean "b"'):
        campaign["bb"]


def test_a_campaign_is_saved_and_read_back(tmp_path: Path) -> None:
    campaign = Campaign((record("a"), record("b")))
    assert Campaign.load(campaign.save(tmp_path / "campaign.npz")) == campaign
    single = Campaign.load(record("a").save(tmp_path / "single.npz"))
    assert single.names == ("a",)


def test_files_are_loaded_by_list_and_by_pattern(tmp_path: Path) -> None:
    for name in ("b", "a", "c"):
        write(tmp_path / f"{name}.csv")
    assert Campaign.load(str(tmp_path / "*.csv")).names == ("a", "b", "c")
    assert Campaign.load([tmp_path / "c.csv", tmp_path / "a.csv"]).names == ("c", "a")
    write(tmp_path / "other" / "a.csv")
    assert Campaign.load([tmp_path / "a.csv", tmp_path / "other" / "a.csv"]).names[1] == "other/a"
    with pytest.raises(ExperimentError, match=r'no file fits the pattern ".*\*\.mat"; check the folder'):
        Campaign.load(str(tmp_path / "*.mat"))


def test_files_that_do_not_belong_together_are_refused(tmp_path: Path) -> None:
    files = [write(tmp_path / "a.csv"), write(tmp_path / "b.csv", "time,axis.position [mm]")]
    with pytest.raises(ExperimentError, match=r'b has no channel "u", which a has; .* optional .* common=True'):
        Campaign.load(files)
    assert Campaign.load(files, common=True).channels == ("axis.position",)
    assert Campaign.load(files, common=True)["a"].history[-1] == "Left out u."
    with pytest.raises(ExperimentError, match=r'"axis\.position" is in m in a and in rad in b; state its unit'):
        Campaign((record("a"), record("b", unit="rad")))
    with pytest.raises(ExperimentError, match=r'records 1 and 2 of the campaign are both named "a"'):
        Campaign((record("a"), record("a")))
    with pytest.raises(ExperimentError, match="at least one record"):
        Campaign(())


def test_time_steps_may_differ_and_one_rate_can_be_asked_for(tmp_path: Path) -> None:
    files = [write(tmp_path / "a.csv"), write(tmp_path / "b.csv", step=0.02)]
    assert [r.rate for r in Campaign.load(files)] == pytest.approx([100.0, 50.0])
    assert [r.rate for r in Campaign.load(files, resample=100.0)] == pytest.approx([100.0, 100.0])


def test_a_split_by_records() -> None:
    campaign = Campaign(tuple(record(name) for name in ("sine-1", "sine-2", "chirp")))
    for train, validation in (
        campaign.split(validation="chirp"),
        campaign.split(train="sine*"),
        campaign.split(["sine-2", "sine-1"], "chirp"),
    ):
        assert (train.names, validation.names) == (("sine-1", "sine-2"), ("chirp",))
    for wrong, words in {
        ("sine-1", "sine*"): 'the record "sine-1" is in both parts',
        ("*", None): "no record is left for validation",
        ("chip", None): 'train: no record is named "chip"; did you mean "chirp"',
        (0.5, "chirp"): "by shares of time or by names",
        (None, None): "a split needs a share or names",
    }.items():
        with pytest.raises(ExperimentError, match=words.replace("*", r"\*")):
            campaign.split(*wrong)  # type: ignore[arg-type]  # wrong on purpose
    with pytest.raises(ExperimentError, match="has no meaning between whole records"):
        campaign.split("chirp", gap=1.0)


@settings(max_examples=40, deadline=None)
@given(
    share=st.floats(0.2, 0.7),
    gap=st.floats(0.0, 0.2),
    start=st.floats(-100.0, 100.0),
    rate=st.sampled_from([50.0, 100.0, 1000.0 / 3.0]),
)
def test_a_split_by_time_shares_no_sample_and_keeps_the_gap(
    share: float, gap: float, start: float, rate: float
) -> None:
    campaign = Campaign((record("a", 300, rate, start=start), record("b", 200, rate)))
    # Of the shorter record enough for a record has to be left behind the gap.
    assume(share * campaign[1].duration + gap + (FEWEST_SAMPLES + 1) * campaign[1].dt < campaign[1].duration)
    train, validation = campaign.split(share, gap=gap)
    for whole, first, last in zip(campaign, train, validation, strict=True):
        assert first.time[0] == whole.time[0]
        assert last.time[-1] == whole.time[-1]
        assert first.duration == pytest.approx(share * whole.duration, abs=1.01 * whole.dt)
        assert last.time[0] - first.time[-1] >= max(gap, 0.9 * whole.dt)
        assert set(first.time).isdisjoint(last.time)
        assert set(first.time) | set(last.time) <= set(whole.time)
        if gap == 0.0:
            assert len(first) + len(last) >= len(whole) - 1
    assert train.names == ("a-train", "b-train")


def test_a_split_by_time_that_cannot_be() -> None:
    campaign = Campaign((record("a"),))
    with pytest.raises(ExperimentError, match=r"shares of 0\.7 and 0\.5 .* are no split"):
        campaign.split(0.7, 0.5)
    with pytest.raises(ExperimentError, match=r"a: the first 0\.7 of 1\.99 s and a gap of 5 s leave nothing"):
        campaign.split(0.7, gap=5.0)
    first, last = campaign.split(0.3, 0.3)
    assert last[0].time[0] - first[0].time[-1] == pytest.approx(0.4 * 1.99, abs=0.02)


def test_a_campaign_stands_for_a_sequence_of_records() -> None:
    model = vpm.Model.load(MODEL)
    campaign = Campaign.load([TRAIN, VALIDATION], model=model)
    listed = [Experiment.load(path, model=model) for path in (TRAIN, VALIDATION)]
    by_campaign = vpm.identify(model, campaign)
    by_list = vpm.identify(model, listed)
    np.testing.assert_array_equal(by_campaign.values, by_list.values)
    assert by_campaign.experiments == campaign.names
