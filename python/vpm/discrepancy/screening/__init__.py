"""Screening: all candidates with their start values, and the linear step by which each is judged."""
