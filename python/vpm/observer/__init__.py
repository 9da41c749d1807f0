"""A model beside its log: what an observer of the record cannot explain, sample by sample."""

from vpm.observer.filtering import Record, filtered, measured_outputs
from vpm.observer.noise import Noise, likely_noise
from vpm.observer.observation import Observation, observe
from vpm.observer.online import Observer

__all__ = ["Noise", "Observation", "Observer", "Record", "filtered", "likely_noise", "measured_outputs", "observe"]
