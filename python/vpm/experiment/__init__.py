"""Measured records: reading and checking logs, filtering them, and the motion and the noise in them."""

from vpm.experiment.campaign import Campaign, as_records
from vpm.experiment.cutoff import CutoffChoice, choose_cutoff
from vpm.experiment.derived import derived_channels, without_derived
from vpm.experiment.draft import plain_table
from vpm.experiment.lengths import joints_from_lengths, joints_from_sensors
from vpm.experiment.motion import Motion, common_cutoff, motion
from vpm.experiment.noise import as_read, drawn_noise, instrument_noise, noise_std, quantisation_step, read_noise
from vpm.experiment.record import Experiment
from vpm.experiment.shafts import joints_from_shafts
from vpm.experiment.signal import decimation_for, differentiate, lowpass, parallel_filter

__all__ = [
    "Campaign",
    "CutoffChoice",
    "Experiment",
    "Motion",
    "as_read",
    "as_records",
    "choose_cutoff",
    "common_cutoff",
    "decimation_for",
    "derived_channels",
    "differentiate",
    "drawn_noise",
    "instrument_noise",
    "joints_from_lengths",
    "joints_from_sensors",
    "joints_from_shafts",
    "lowpass",
    "motion",
    "noise_std",
    "parallel_filter",
    "plain_table",
    "quantisation_step",
    "read_noise",
    "without_derived",
]
