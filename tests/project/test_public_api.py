"""What users may rely on changes by intention alone."""

from public_api import LIST, lines


def test_the_public_names_are_those_of_the_list() -> None:
    listed, found = LIST.read_text(encoding="utf-8").splitlines(), lines()
    gone = [line for line in listed if line not in found]
    fresh = [line for line in found if line not in listed]
    rule = "what leaves goes through a version that warns (docs/python.md)"
    told = f"{rule}; `python tests/support/public_api.py` writes the list"
    assert (gone, fresh) == ([], []), told
