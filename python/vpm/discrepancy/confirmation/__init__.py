"""Confirmation of a candidate: its refit, its prediction of validation records, and reasons of refusal."""
