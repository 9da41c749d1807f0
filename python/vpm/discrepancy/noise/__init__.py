"""Noise: its floor and spectrum in a residual, and what else in a residual is no missing physics."""
