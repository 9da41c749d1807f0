"""Drives: one file for each kind, with its keys, checks, parameters, channels, states, and what the core is told."""
