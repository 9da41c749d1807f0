"""What the package computes beside numbers that it did not make: closed forms, published values, converged solutions of other codes.

`python -m validation` (from the folder `tests`) writes the table of `docs/validation.md`; `tests/test_validation.py` holds every row of it.
"""
