"""What the package computes beside numbers that it did not make: closed forms, published values, other codes.

`make validation` writes the table of `docs/validation.md`; `tests/project/test_validation.py` and the core's own
tests hold every row.
"""
