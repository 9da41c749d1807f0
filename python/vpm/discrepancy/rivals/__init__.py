"""Rivals of an accepted effect: found, exchanged for it, or discriminated from it by an experiment."""
