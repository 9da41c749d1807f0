"""What the package computes beside numbers that it did not make: closed forms, published values, other codes.

`make validation` writes `docs/validation.md` and its table `docs/validation.csv`. The tests of
`tests/project/test_validation.py` and the core's own hold every row.
"""
