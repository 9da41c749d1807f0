"""Screening: all candidates with their start values and bounds."""
