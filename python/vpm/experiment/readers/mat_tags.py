"""The tags of a MATLAB file of version 5: checked before SciPy reads them, which trusts each and may end the process.

Source: MathWorks, *MAT-File Format*, 2024: a header of 128 bytes, then elements with a tag of type and size; those of
type miMATRIX hold flags, dimensions, a name and the content of their class.
"""

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike
from pathlib import Path

from vpm.errors import ExperimentError

_HEADER = 128
#: Bytes of one number of each type of data.
_WIDTHS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_INT8, _INT32, _UINT32, _MATRIX, _COMPRESSED = 1, 5, 6, 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE = 1, 2, 3, 4, 5
_NUMBERS = range(6, 16)
#: Cells and structures within each other, and bytes of all that is unpacked.
DEEPEST, LARGEST = 32, 1 << 31


@dataclass(frozen=True)
class _Element:
    kind: int
    data: memoryview
    end: int


class _Broken(Exception):  # noqa: N818
    """A damaged MAT file; the message says how, and never leaves this module."""


def check_tags(path: str | PathLike[str]) -> None:
    """Refuse a file whose tags do not fit its content; files of other versions are left to their readers."""
    content = memoryview(Path(path).read_bytes())
    order = {b"IM": "<", b"MI": ">"}.get(bytes(content[126:128]))
    if order is None or len(content) < _HEADER or content[125 if order == "<" else 124] != 1:
        return
    try:
        at = _HEADER
        while at < len(content):
            element = _element(content, at, order, padded=False)
            _check_variable(element, order)
            at = element.end
    except (_Broken, struct.error, zlib.error) as error:
        raise ExperimentError(
            f"{path} cannot be read as a MATLAB file (at byte {at}: {error}); save it anew with save -v7 or -v7.3, or "
            "export the log as CSV",
            path=str(path),
        ) from error


def _element(content: memoryview, at: int, order: str, *, padded: bool = True) -> _Element:
    """The element whose tag begins there; small ones have their data within the tag."""
    if len(content) - at < 8:
        raise _Broken(f"a tag of 8 bytes has {len(content) - at}")
    kind, size = struct.unpack_from(f"{order}II", content, at)
    begin = at + 8
    if kind >> 16:
        kind, size, begin = kind & 0xFFFF, kind >> 16, at + 4
        if size > 4:
            raise _Broken(f"a small element has {size} bytes, and 4 have room")
        return _Element(kind, content[begin : begin + size], at + 8)
    end = begin + size
    if end > len(content):
        raise _Broken(f"an element of {size} bytes has {len(content) - begin}")
    return _Element(kind, content[begin:end], min(len(content), end + (-size % 8 if padded else 0)))


def _check_variable(element: _Element, order: str) -> None:
    if element.kind == _COMPRESSED:
        unpacking = zlib.decompressobj()
        plain = memoryview(unpacking.decompress(element.data, LARGEST))
        if not unpacking.eof:
            raise _Broken("a packed variable does not end")
        element = _element(plain, 0, order)
    if element.kind != _MATRIX:
        raise _Broken(f"a variable is of type {element.kind}, which is none")
    _check_matrix(element.data, order, 0)


def _check_matrix(data: memoryview, order: str, depth: int) -> None:
    if not len(data):  # an empty one, as fields that were never set are
        if depth == 0:
            raise _Broken("a variable is empty")
        return
    if depth > DEEPEST:
        raise _Broken(f"cells are nested more than {DEEPEST} deep")
    parts = _parts(data, order)
    flags = next(parts)
    if flags.kind != _UINT32 or len(flags.data) != 8:
        raise _Broken("the flags of a variable are none")
    word = struct.unpack_from(f"{order}I", flags.data)[0]
    kind, complex_ = word & 0xFF, bool(word & 0x800)
    dimensions = _dimensions(next(parts), order)
    count = math.prod(dimensions)
    if next(parts).kind != _INT8:
        raise _Broken("the name of a variable is none")
    if kind in _NUMBERS:
        for _ in range(2 if complex_ else 1):
            _check_count(next(parts), count)
    elif kind == _CHAR:
        _check_text(next(parts), count)
    elif kind == _SPARSE:
        _check_sparse(parts, dimensions, order, complex_=complex_)
    elif kind in {_CELL, _STRUCT, _OBJECT}:
        _check_members(parts, kind, count, order, depth)
    else:
        raise _Broken(f"a variable is of class {kind}, such as a function or an object, which holds no columns")


def _dimensions(sizes: _Element, order: str) -> tuple[int, ...]:
    if sizes.kind != _INT32 or len(sizes.data) < 8 or len(sizes.data) % 4 or len(sizes.data) > 4 * DEEPEST:
        raise _Broken("the dimensions of a variable are none")
    found = struct.unpack(f"{order}{len(sizes.data) // 4}i", sizes.data)
    if min(found) < 0 or math.prod(found) > LARGEST:
        raise _Broken(f"a variable has the dimensions {' x '.join(map(str, found))}")
    return found


def _parts(data: memoryview, order: str) -> Iterator[_Element]:
    at = 0
    while at < len(data):
        element = _element(data, at, order)
        yield element
        at = element.end
    raise _Broken("a variable ends before its content")


def _check_count(element: _Element, count: int) -> None:
    width = _WIDTHS.get(element.kind)
    if width is None or element.kind > 13:
        raise _Broken(f"numbers are of type {element.kind}, which is none")
    if len(element.data) != width * count:
        raise _Broken(f"{count} numbers of {width} bytes have {len(element.data)} bytes")


def _check_text(element: _Element, count: int) -> None:
    width = _WIDTHS.get(element.kind)
    if width is None or len(element.data) % width or not width * count <= len(element.data) <= 4 * count:
        raise _Broken(f"a text of {count} letters has {len(element.data)} bytes of type {element.kind}")


def _check_sparse(parts: Iterator[_Element], dimensions: tuple[int, ...], order: str, *, complex_: bool) -> None:
    rows, begins = next(parts), next(parts)
    if {rows.kind, begins.kind} != {_INT32} or len(rows.data) % 4 or len(begins.data) != 4 * (dimensions[1] + 1):
        raise _Broken("the places of a sparse matrix are none")
    place = struct.unpack(f"{order}{len(rows.data) // 4}i", rows.data)
    begin = struct.unpack(f"{order}{dimensions[1] + 1}i", begins.data)
    if any(not 0 <= row < dimensions[0] for row in place) or begin[0] != 0 or begin[-1] > len(place):
        raise _Broken("a place of a sparse matrix is beyond it")
    if any(after < before for before, after in pairwise(begin)):
        raise _Broken("the columns of a sparse matrix go back")
    for _ in range(2 if complex_ else 1):
        _check_count(next(parts), begin[-1])


def _check_members(parts: Iterator[_Element], kind: int, count: int, order: str, depth: int) -> None:
    if kind == _OBJECT and next(parts).kind != _INT8:
        raise _Broken("the name of a class is none")
    if kind in {_STRUCT, _OBJECT}:
        length, names = next(parts), next(parts)
        if length.kind != _INT32 or len(length.data) != 4 or names.kind != _INT8:
            raise _Broken("the names of a structure are none")
        each = struct.unpack(f"{order}i", length.data)[0]
        if not 0 < each <= 1 << 16 or len(names.data) % each:
            raise _Broken(f"names of {each} letters have {len(names.data)} bytes")
        fields = len(names.data) // each
        if not fields and count > 1:
            raise _Broken(f"{count} structures have no field")
        count *= fields
    for _ in range(count):
        member = next(parts)
        if member.kind != _MATRIX:
            raise _Broken(f"a member is of type {member.kind}, which is none")
        _check_matrix(member.data, order, depth + 1)
