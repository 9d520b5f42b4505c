"""Real spherical harmonics up to the quadratic band, orthonormal, in the order (l, m) = 00, 1-1, 10, 11, 2-2 … 22."""

from __future__ import annotations

import math

import numpy as np

from bake.arrays import Float64Array

COUNT = 9

Y0 = 0.5 / math.sqrt(math.pi)
Y1 = math.sqrt(3.0 / (4.0 * math.pi))
Y2_PRODUCT = math.sqrt(15.0 / (4.0 * math.pi))  # of two different coordinates
Y2_ZONAL = math.sqrt(5.0 / (16.0 * math.pi))
Y2_DIFFERENCE = math.sqrt(15.0 / (16.0 * math.pi))


def evaluate(directions: Float64Array) -> Float64Array:
    """The nine basis functions at unit directions, shape (n, 3), as shape (n, 9), float64.

    Band 1 is (y, z, x) and band 2 (xy, yz, 3z² - 1, xz, x² - y²), each times its constant and without the
    Condon-Shortley sign, as is usual in graphics (Ramamoorthi and Hanrahan 2001, equation 3).
    """
    x, y, z = directions.T
    return np.stack(
        [
            np.full(len(directions), Y0),
            Y1 * y,
            Y1 * z,
            Y1 * x,
            Y2_PRODUCT * x * y,
            Y2_PRODUCT * y * z,
            Y2_ZONAL * (3.0 * z * z - 1.0),
            Y2_PRODUCT * x * z,
            Y2_DIFFERENCE * (x * x - y * y),
        ],
        axis=1,
    )
