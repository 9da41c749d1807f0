"""Rivals of an accepted effect: found, or discriminated from it by an experiment."""
