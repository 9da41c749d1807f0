"""The package is marked as typed; that its stub agrees with the compiled module is for `make lint` to say."""

from places import ROOT


def test_package_is_marked_as_typed() -> None:
    assert (ROOT / "python" / "vpm" / "py.typed").is_file()
