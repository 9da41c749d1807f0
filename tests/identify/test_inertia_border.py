"""Where the inertia of a body ends that a fit moves too far."""

import numpy as np
import pytest

from vpm.identify.moments import tensor_to_the_border


def test_an_inertia_ends_where_no_body_has_more() -> None:
    """Second moments of mass, half the trace less the inertia, are those of a body that is flat at the end."""
    before = np.array([2.0, 3.0, 4.0, 0.1, -0.2, 0.3])
    far = np.array([9.0, 1.0, 1.0, 2.0, 0.0, 0.0])
    found = tensor_to_the_border(before, far)
    share = (found - before) / (far - before)
    assert share == pytest.approx(np.full(6, share[0]), rel=1e-9)
    xx, yy, zz, xy, xz, yz = found
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = np.linalg.eigvalsh(tensor)
    assert moments[2] == pytest.approx(moments[0] + moments[1], rel=1e-5)
    assert np.array_equal(tensor_to_the_border(before, 1.1 * before), 1.1 * before)
