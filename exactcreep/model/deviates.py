"""The compiled random numbers behind `disorder`: words of Philox, and normal deviates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numba.extending import intrinsic

from exactcreep.compiling import apart, compiled, inlined, merged

_MULTIPLIER_0 = np.uint64(0xD2E7470EE14C6C93)
_MULTIPLIER_1 = np.uint64(0xCA5A826395121157)
_WEYL_0 = np.uint64(0x9E3779B97F4A7C15)
_WEYL_1 = np.uint64(0xBB67AE8584CAA73B)
CELL = 2.0**-53
CENTRE = 2.0**-54 - 0.5  # of the first cell, minus 1/2
_FRACTION = np.int64(0x000FFFFFFFFFFFFF)  # the fraction's bits of a float64
_HALF = np.int64(0x3FE0000000000000)  # the bits of 0.5
ROOT_HALF = 0.7071067811865476
ODD = np.array([1.0 / k for k in range(23, 1, -2)])
LN2_HIGH = 6.93147180369123816490e-01  # ln 2 with its last 20 bits zero, so that e * it is exact
LN2_LOW = 1.90821492927058770002e-10

# AS 241 for abs(probability - 1/2) <= CENTRAL, highest power first
CENTRAL = 0.425
CENTRAL_SQUARE = 0.180625
NUMERATOR = np.array([
    2.5090809287301226727e3, 3.3430575583588128105e4, 6.7265770927008700853e4,
    4.5921953931549871457e4, 1.3731693765509461125e4, 1.9715909503065514427e3,
    1.3314166789178437745e2, 3.3871328727963666080e0,
])  # fmt: skip
DENOMINATOR = np.array([
    5.2264952788528545610e3, 2.8729085735721942674e4, 3.9307895800092710610e4,
    2.1213794301586595867e4, 5.3941960214247511077e3, 6.8718700749205790830e2,
    4.2313330701600911252e1, 1.0,
])  # fmt: skip
# the same in r - 1.6, r = sqrt(-ln of the smaller probability) <= NEAR_TAIL
NEAR_TAIL = 5.0
NEAR_CENTRE = 1.6
NEAR_NUMERATOR = np.array([
    7.74545014278341407640e-4, 2.27238449892691845833e-2, 2.41780725177450611770e-1,
    1.27045825245236838258e0, 3.64784832476320460504e0, 5.76949722146069140550e0,
    4.63033784615654529590e0, 1.42343711074968357734e0,
])  # fmt: skip
NEAR_DENOMINATOR = np.array([
    1.05075007164441684324e-9, 5.47593808499534494600e-4, 1.51986665636164571966e-2,
    1.48103976427480074590e-1, 6.89767334985100004550e-1, 1.67638483018380384940e0,
    2.05319162663775882187e0, 1.0,
])  # fmt: skip
# and in r - 5 for the rest
FAR_NUMERATOR = np.array([
    2.01033439929228813265e-7, 2.71155556874348757815e-5, 1.24266094738807843860e-3,
    2.65321895265761230930e-2, 2.96560571828504891230e-1, 1.78482653991729133580e0,
    5.46378491116411436990e0, 6.65790464350110377720e0,
])  # fmt: skip
FAR_DENOMINATOR = np.array([
    2.04426310338993978564e-15, 1.42151175831644588870e-7, 1.84631831751005468180e-5,
    7.86869131145613259100e-4, 1.48753612908506148525e-2, 1.36929880922735805310e-1,
    5.99832206555887937690e-1, 1.0,
])  # fmt: skip


@intrinsic
def _product(typing_context: Any, a: Any, b: Any) -> Any:
    """Return the upper and the lower 64 bits of the product of two uint64."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        from llvmlite import ir  # the compiler's own types, needed only while compiling

        wide = ir.IntType(128)
        word = ir.IntType(64)
        product = builder.mul(builder.zext(arguments[0], wide), builder.zext(arguments[1], wide))
        upper = builder.trunc(builder.lshr(product, ir.Constant(wide, 64)), word)
        words = [upper, builder.trunc(product, word)]
        return context.make_tuple(builder, signature.return_type, words)

    return types.UniTuple(types.uint64, 2)(types.uint64, types.uint64), generate


@inlined
def philox(seed, stream, n, block):
    """Return the four words of block `block` of (seed, stream, n): Philox 4x64-10."""
    c0 = np.uint64(block) + np.uint64(1)  # NumPy steps the counter before it uses it
    c1 = np.uint64(n)
    c2 = np.uint64(0)
    c3 = np.uint64(0)
    k0 = np.uint64(seed)
    k1 = np.uint64(stream)
    for turn in range(10):
        if turn > 0:
            k0 = k0 + _WEYL_0
            k1 = k1 + _WEYL_1
        high0, low0 = _product(_MULTIPLIER_0, c0)
        high1, low1 = _product(_MULTIPLIER_1, c2)
        c0 = high1 ^ c1 ^ k0
        c1 = low1
        c2 = high0 ^ c3 ^ k1
        c3 = low0
    return c0, c1, c2, c3


@merged
def logarithm_of(mantissa, exponent):
    """Return ln(mantissa 2**exponent) for mantissas about 1, floats or vectors of them."""
    z = (mantissa - 1.0) / (mantissa + 1.0)
    w = z * z
    series = ODD[0] * w + ODD[1]
    for k in range(2, ODD.size):
        series = series * w + ODD[k]
    return exponent * LN2_HIGH + (exponent * LN2_LOW + 2.0 * z * w * series + 2.0 * z)


@inlined
def _logarithm(x):
    """Return ln x for a positive normal x, within 1 ulp, with only +, -, * and /."""
    bits = np.float64(x).view(np.int64)
    exponent = (bits >> 52) - 1022
    mantissa = np.int64((bits & _FRACTION) | _HALF).view(np.float64)  # in [1/2, 1)
    if mantissa < ROOT_HALF:
        mantissa *= 2.0
        exponent -= 1
    return logarithm_of(mantissa, exponent)


@merged
def fraction(numerator, denominator, r):
    """Return the two polynomials of degree 7 at r, a float or a vector of them."""
    top = numerator[0] * r + numerator[1]
    low = denominator[0] * r + denominator[1]
    for k in range(2, 8):
        top = top * r + numerator[k]
        low = low * r + denominator[k]
    return top, low


@apart
def normal_tail(q):
    """Return the normal deviate of the probability 1/2 + q for abs(q) > `CENTRAL`."""
    r = 0.5 - abs(q)
    r = math.sqrt(-_logarithm(r))
    if r <= NEAR_TAIL:
        top, low = fraction(NEAR_NUMERATOR, NEAR_DENOMINATOR, r - NEAR_CENTRE)
    else:
        top, low = fraction(FAR_NUMERATOR, FAR_DENOMINATOR, r - NEAR_TAIL)
    z = top / low
    return -z if q < 0.0 else z


@inlined
def centred(word):
    """Return the probability of a word, the centre of one of 2**53 cells, minus 1/2."""
    return np.float64(np.int64(word >> np.uint64(11))) * CELL + CENTRE


@inlined
def normal_deviate(word):
    """Return the normal deviate of a 64-bit word, within 4 ulp, by Wichura's AS 241 (PPND16)."""
    q = centred(word)
    if abs(q) > CENTRAL:
        return normal_tail(q)
    top, low = fraction(NUMERATOR, DENOMINATOR, CENTRAL_SQUARE - q * q)
    return q * top / low


@compiled
def deviates(seed, stream, n, first, out):
    """Fill row i of `out` with the deviates `first`, ... of (seed, stream, n + i)."""
    for i in range(out.shape[0]):
        k = first
        for j in range(out.shape[1]):
            if j == 0 or k % 4 == 0:
                words = philox(seed, stream, n + i, k // 4)
            out[i, j] = normal_deviate(words[k % 4])
            k += 1
