"""Eight sliders at a time: a vector of 8 float64 for the compiled kernel.

A small room of its own, because compiled loops over 8 columns do not reliably become vector
instructions. Inside functions compiled by numba a `Lanes` value is added, subtracted and
multiplied with operators; the functions below do the rest. Comparisons give a mask, an integer
whose bit j belongs to lane j. Every operation is one IEEE operation per lane (`fused` rounds once),
so that results do not depend on the width of the machine's registers.
`tests/solvers/exact/test_simd.py` holds each one against NumPy lane by lane.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel.models import PrimitiveModel
from numba.extending import intrinsic, overload, register_model

WIDTH = 8
"""Lanes of a vector."""


class Lanes(types.Type):  # type: ignore[misc]
    """The numba type of a vector of `WIDTH` float64; it exists only inside compiled functions."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


lanes = Lanes()
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_WORDS = ir.VectorType(ir.IntType(64), WIDTH)
_BYTE = ir.IntType(WIDTH)
_WORD = ir.IntType(64)
_INDICES = ir.VectorType(ir.IntType(32), WIDTH)


@register_model(Lanes)
class _LanesModel(PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _spread(builder: Any, value: Any) -> Any:
    first = builder.insert_element(
        ir.Constant(_VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0)
    )
    zeros = ir.Constant(_INDICES, [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), zeros)


def _from_mask(builder: Any, mask: Any) -> Any:
    return builder.bitcast(builder.trunc(mask, _BYTE), _BITS)


def _to_mask(builder: Any, bits: Any) -> Any:
    return builder.zext(builder.bitcast(bits, _BYTE), _WORD)


def _gathered(builder: Any, kind: Any, values: list[Any]) -> Any:
    vector = ir.Constant(kind, ir.Undefined)
    for j, value in enumerate(values):
        vector = builder.insert_element(vector, value, ir.Constant(ir.IntType(32), j))
    return vector


def _exponent(builder: Any, values: list[Any]) -> Any:
    bits = builder.bitcast(values[0], _WORDS)
    biased = builder.lshr(bits, ir.Constant(_WORDS, [52] * WIDTH))
    return builder.sitofp(builder.sub(biased, ir.Constant(_WORDS, [1022] * WIDTH)), _VECTOR)


def _mantissa(builder: Any, values: list[Any]) -> Any:
    bits = builder.bitcast(values[0], _WORDS)
    fraction = builder.and_(bits, ir.Constant(_WORDS, [2**52 - 1] * WIDTH))
    half = ir.Constant(_WORDS, [1022 << 52] * WIDTH)
    return builder.bitcast(builder.or_(fraction, half), _VECTOR)


def _called(builder: Any, name: str, result: Any, arguments: list[Any]) -> Any:
    kind = ir.FunctionType(result, [argument.type for argument in arguments])
    function = cgutils.get_or_insert_function(builder.module, kind, name)
    return builder.call(function, arguments)


def _address(context: Any, builder: Any, kind: Any, array: Any, row: Any, column: Any) -> Any:
    """Return the address of array[row, column] of a C-ordered array."""
    structure = context.make_array(kind)(context, builder, array)
    width = builder.extract_value(structure.shape, 1)
    index = builder.add(builder.mul(row, width), column)
    cell = builder.gep(structure.data, [index])
    return builder.bitcast(cell, _VECTOR.as_pointer())


@intrinsic
def load(typing_context: Any, array: Any, row: Any, column: Any) -> Any:
    """Return array[row, column : column + 8]."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row = context.cast(builder, arguments[1], signature.args[1], types.intp)
        column = context.cast(builder, arguments[2], signature.args[2], types.intp)
        address = _address(context, builder, signature.args[0], arguments[0], row, column)
        return builder.load(address, align=8)

    return lanes(array, row, column), generate


@intrinsic
def store(typing_context: Any, array: Any, row: Any, column: Any, value: Any) -> Any:
    """Set array[row, column : column + 8] to `value`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row = context.cast(builder, arguments[1], signature.args[1], types.intp)
        column = context.cast(builder, arguments[2], signature.args[2], types.intp)
        address = _address(context, builder, signature.args[0], arguments[0], row, column)
        builder.store(arguments[3], address, align=8)
        return context.get_dummy_value()

    return types.none(array, row, column, lanes), generate


def _in_row(context: Any, builder: Any, kind: Any, array: Any, row: Any, lane: Any) -> Any:
    """Return the address of array[row, lane] of a C-ordered array of shape (..., 8)."""
    data = context.make_array(kind)(context, builder, array).data
    first = builder.mul(row, ir.Constant(row.type, WIDTH))
    return builder.gep(data, [first if lane is None else builder.add(first, lane)])


@intrinsic
def take(typing_context: Any, array: Any, row: Any) -> Any:
    """Return array[row] of an array of shape (..., 8)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row = context.cast(builder, arguments[1], signature.args[1], types.intp)
        address = _in_row(context, builder, signature.args[0], arguments[0], row, None)
        return builder.load(builder.bitcast(address, _VECTOR.as_pointer()), align=8)

    return lanes(array, row), generate


@intrinsic
def put(typing_context: Any, array: Any, row: Any, value: Any) -> Any:
    """Set array[row] of an array of shape (..., 8) to `value`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row = context.cast(builder, arguments[1], signature.args[1], types.intp)
        address = _in_row(context, builder, signature.args[0], arguments[0], row, None)
        builder.store(arguments[2], builder.bitcast(address, _VECTOR.as_pointer()), align=8)
        return context.get_dummy_value()

    return types.none(array, row, lanes), generate


@intrinsic
def element(typing_context: Any, array: Any, row: Any, lane: Any) -> Any:
    """Return array[row, lane] of an array of shape (..., 8); neither index is negative."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row = context.cast(builder, arguments[1], signature.args[1], types.intp)
        lane = context.cast(builder, arguments[2], signature.args[2], types.intp)
        return builder.load(
            _in_row(context, builder, signature.args[0], arguments[0], row, lane), align=8
        )

    return types.float64(array, row, lane), generate


@intrinsic
def everywhere(typing_context: Any, array: Any, row: Any, lane: Any) -> Any:
    """Return a vector whose lanes all hold array[row, lane] of an array of shape (..., 8)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row = context.cast(builder, arguments[1], signature.args[1], types.intp)
        lane = context.cast(builder, arguments[2], signature.args[2], types.intp)
        address = _in_row(context, builder, signature.args[0], arguments[0], row, lane)
        return _spread(builder, builder.load(address, align=8))

    return lanes(array, row, lane), generate


@intrinsic
def align_stack(typing_context: Any) -> Any:
    """Let the function that calls this keep its spilled vectors within cache lines."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.function.attributes.alignstack = 64
        builder.function.attributes.add("nounwind")  # alone the other is not written out
        return context.get_dummy_value()

    return types.none(), generate


@intrinsic
def spread(typing_context: Any, value: Any) -> Any:
    """Return a vector whose lanes all hold `value`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _spread(builder, arguments[0])

    return lanes(types.float64), generate


def _operation(emit: Callable[[Any, list[Any]], Any], arity: int, result: Any) -> Any:
    """Return an intrinsic on `arity` vectors; `emit` builds it from their values."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return emit(builder, list(arguments))

    if arity == 1:

        @intrinsic
        def unary(typing_context: Any, a: Any) -> Any:
            return result(lanes), generate

        return unary
    if arity == 2:

        @intrinsic
        def binary(typing_context: Any, a: Any, b: Any) -> Any:
            return result(lanes, lanes), generate

        return binary

    @intrinsic
    def ternary(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
        return result(lanes, lanes, lanes), generate

    return ternary


def _vector_call(name: str) -> Callable[[Any, list[Any]], Any]:
    return lambda builder, arguments: _called(
        builder, f"llvm.{name}.v{WIDTH}f64", _VECTOR, arguments
    )


def _reduced(name: str) -> Callable[[Any, list[Any]], Any]:
    """Return a reduction that need not look for lanes that are not numbers."""

    def emit(builder: Any, arguments: list[Any]) -> Any:
        kind = ir.FunctionType(ir.DoubleType(), [_VECTOR])
        function = cgutils.get_or_insert_function(
            builder.module, kind, f"llvm.vector.reduce.{name}.v{WIDTH}f64"
        )
        return builder.call(function, arguments, fastmath=("nnan",))

    return emit


def _shuffled(order: list[int]) -> Callable[[Any, list[Any]], Any]:
    indices = ir.Constant(_INDICES, order)
    return lambda builder, arguments: builder.shuffle_vector(*arguments, indices)


_add = _operation(lambda builder, v: builder.fadd(*v), 2, lanes)
_subtract = _operation(lambda builder, v: builder.fsub(*v), 2, lanes)
_multiply = _operation(lambda builder, v: builder.fmul(*v), 2, lanes)
_divide = _operation(lambda builder, v: builder.fdiv(*v), 2, lanes)

fused = _operation(_vector_call("fma"), 3, lanes)
"""fused(a, b, c) = a b + c, rounded once."""
magnitude = _operation(_vector_call("fabs"), 1, lanes)
"""|a|."""
square_root = _operation(_vector_call("sqrt"), 1, lanes)
"""sqrt(a), NaN where a < 0."""
mantissa = _operation(_mantissa, 1, lanes)
"""m of a = m 2**e with m in [1/2, 1), for positive normal a."""
exponent = _operation(_exponent, 1, lanes)
"""e of a = m 2**e, for positive normal a."""
smaller = _operation(lambda builder, v: builder.select(builder.fcmp_ordered("<", *v), *v), 2, lanes)
"""The smaller of a and b in each lane, b where a is not a number."""
larger = _operation(lambda builder, v: builder.select(builder.fcmp_ordered(">", *v), *v), 2, lanes)
"""The larger of a and b in each lane, b where a is not a number."""
least = _operation(_reduced("fmin"), 1, types.float64)
"""The smallest of the lanes of a, all of which are numbers."""
largest = _operation(_reduced("fmax"), 1, types.float64)
"""The largest of the lanes of a, all of which are numbers."""
from_left = _operation(_shuffled([WIDTH - 1, *range(WIDTH, 2 * WIDTH - 1)]), 2, lanes)
"""from_left(previous, a): lane j holds lane j - 1 of a, lane 0 the last lane of `previous`."""
from_right = _operation(_shuffled([*range(1, WIDTH), WIDTH]), 2, lanes)
"""from_right(a, following): lane j holds lane j + 1 of a, the last the first of `following`."""
turned_right = _operation(
    lambda builder, v: builder.shuffle_vector(
        v[0], v[0], ir.Constant(_INDICES, [WIDTH - 1, *range(WIDTH - 1)])
    ),
    1,
    lanes,
)
"""turned_right(a): lane j holds lane j - 1 of a, lane 0 the last lane."""
turned_left = _operation(
    lambda builder, v: builder.shuffle_vector(
        v[0], v[0], ir.Constant(_INDICES, [*range(1, WIDTH), 0])
    ),
    1,
    lanes,
)
"""turned_left(a): lane j holds lane j + 1 of a, the last lane the first."""
below = _operation(
    lambda builder, v: _to_mask(builder, builder.fcmp_ordered("<", *v)), 2, types.int64
)
"""Mask of the lanes with a < b."""
not_above = _operation(
    lambda builder, v: _to_mask(builder, builder.fcmp_ordered("<=", *v)), 2, types.int64
)
"""Mask of the lanes with a <= b."""


@intrinsic
def choose(typing_context: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return lane by lane `a` where the mask is set, else `b`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.select(_from_mask(builder, arguments[0]), arguments[1], arguments[2])

    return lanes(types.int64, lanes, lanes), generate


@intrinsic
def together(
    typing_context: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any
) -> Any:
    """Return the vector of eight floats."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _gathered(builder, _VECTOR, arguments)

    return lanes(*[types.float64] * WIDTH), generate


@intrinsic
def upper_bits(
    typing_context: Any, a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any
) -> Any:
    """Return the upper 53 bits of eight uint64, as whole numbers."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        words = _gathered(builder, _WORDS, arguments)
        return builder.sitofp(builder.lshr(words, ir.Constant(_WORDS, [11] * WIDTH)), _VECTOR)

    return lanes(*[types.uint64] * WIDTH), generate


@intrinsic
def lane_of(typing_context: Any, a: Any, j: Any) -> Any:
    """Return lane j of a."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.extract_element(*arguments)

    return types.float64(lanes, types.intp), generate


@intrinsic
def fused_scalar(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a b + c of three floats, rounded once."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _called(builder, "llvm.fma.f64", ir.DoubleType(), list(arguments))

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic
def lowest_bit(typing_context: Any, mask: Any) -> Any:
    """Return the number of the lowest set bit of a mask that is not zero."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.cttz(arguments[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.int64), generate


def _operator(symbol: Any, instruction: Any) -> None:
    @overload(symbol)
    def resolve(a, b):  # numba compares the two signatures
        if isinstance(a, Lanes) and isinstance(b, Lanes):
            return lambda a, b: instruction(a, b)  # noqa: PLW0108 - numba wants a function
        return None


_operator(operator.add, _add)
_operator(operator.sub, _subtract)
_operator(operator.mul, _multiply)
_operator(operator.truediv, _divide)
