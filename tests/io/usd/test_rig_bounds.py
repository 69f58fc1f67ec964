import numpy as np

from usdface.io.usd.rig_bounds import posed_bounds
from usdface.rigs import BlendShape, Inbetween, Mesh


def test_an_inbetween_that_reaches_further_than_its_shape_counts() -> None:
    index, up = np.array([1]), np.array([[0.0, 1.0, 0.0]])
    bent = BlendShape("lid", index, up, inbetweens=(Inbetween("out", 0.5, 3.0 * up),))
    still = BlendShape("still", np.zeros(0, int), np.zeros((0, 3)))
    mesh = Mesh("m", np.zeros((3, 3)), np.array([3]), np.arange(3), shapes=(bent, still))
    np.testing.assert_array_equal(posed_bounds(mesh, None, ()), [[0, 0, 0], [0, 3, 0]])
