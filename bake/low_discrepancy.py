"""Owen-scrambled Sobol points in two dimensions, in NumPy; `bake/kernels/rays.py` holds the device twin.

Points are made from their index alone, so that a sequence can be continued, split into aligned blocks and rebuilt on
any device without a table.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bake.types import Float64Array, UInt32Array

_U32 = np.uint32


def reverse_bits(x: UInt32Array) -> UInt32Array:
    """Reverses the 32 bits of each value."""
    for shift, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F), (8, 0x00FF00FF)):
        x = ((x >> _U32(shift)) & _U32(mask)) | ((x & _U32(mask)) << _U32(shift))
    return (x >> _U32(16)) | (x << _U32(16))


def scramble_reversed(x: UInt32Array, seed: UInt32Array) -> UInt32Array:
    """An Owen scramble of bit-reversed values: each bit is flipped depending on the bits below it.

    References:
        Burley 2020, "Practical Hash-based Owen Scrambling", JCGT 9(4), with the hash constants of Vegdahl 2021.
    """
    x = x ^ (x * _U32(0x3D20ADEA))
    x = x + seed
    x = x * ((seed >> _U32(16)) | _U32(1))
    x = x ^ (x * _U32(0x05526C56))
    return x ^ (x * _U32(0x53A22864))


def second_dimension_reversed(index: UInt32Array) -> UInt32Array:
    """Sobol's second dimension with its bits reversed.

    Its generator matrix is Pascal's triangle modulo 2, that is the substitution x → x + 1 in polynomials over GF(2),
    which needs five exclusive-ors.
    """
    x = index
    for shift, mask in ((16, 0xFFFF0000), (8, 0xFF00FF00), (4, 0xF0F0F0F0), (2, 0xCCCCCCCC), (1, 0xAAAAAAAA)):
        x = x ^ ((x & _U32(mask)) >> _U32(shift))
    return x


def hash_u32(x: UInt32Array) -> UInt32Array:
    """A good 32-bit mixing function (Wellons 2018, "lowbias32")."""
    x = (x ^ (x >> _U32(16))) * _U32(0x7FEB352D)
    x = (x ^ (x >> _U32(15))) * _U32(0x846CA68B)
    return x ^ (x >> _U32(16))


def to_unit(x: UInt32Array) -> Float64Array:
    """Values in (0, 1) on a grid of 2^-23, centred in their cells, exact in float32."""
    return ((x >> _U32(9)).astype(np.float64) + 0.5) * 2.0**-23


def thresholds(index: NDArray[np.integer], seed: NDArray[np.integer]) -> Float64Array:
    """One number in (0, 1) a ray, evenly spread over the rays of a sample: a golden-ratio sequence, shifted by seed.

    A ray stops at the first partly open face behind which no more than this share of it would be left. That draws the
    stopping face from its distribution, with one number however many faces the ray meets.
    """
    with np.errstate(over="ignore"):
        i, s = index.astype(_U32), seed.astype(_U32)
        return to_unit(hash_u32(s ^ _U32(0x2545F491)) + i * _U32(0x9E3779B9))


def owen_sobol(index: NDArray[np.integer], seed: NDArray[np.integer]) -> tuple[Float64Array, Float64Array]:
    """Points `index` of the two-dimensional sequences scrambled with `seed`.

    Args:
        index, seed: Shape (n,), below 2^32.

    Returns:
        Two coordinates, shape (n,), in (0, 1).
    """
    with np.errstate(over="ignore"):
        i, s = index.astype(_U32), seed.astype(_U32)
        first = reverse_bits(scramble_reversed(i, hash_u32(s)))
        second = reverse_bits(scramble_reversed(second_dimension_reversed(i), hash_u32(s ^ _U32(0x9E3779B9))))
    return to_unit(first), to_unit(second)
