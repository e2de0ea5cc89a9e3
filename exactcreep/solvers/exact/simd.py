"""Eight sliders at a time: a vector of float64 for the compiled kernel.

The compiler does not reliably turn loops over eight columns into vector instructions, but it does
so for `Lanes`. Compiled functions add, subtract, multiply and divide such vectors, take ``abs``,
``math.sqrt``, ``min`` and ``max`` (the second argument if one argument is nan), and compare them. A
comparison gives a mask, an integer whose bit j belongs to lane j. A float among the operands is
used in all lanes. The functions below do the rest.

Every operation is one IEEE operation per lane (`fused` rounds once), so that results do not depend
on the width of the machine's registers. `tests/solvers/exact/test_draws.py` compares lanes with
single numbers. Tables are C-ordered, with rows of eight cells; no index is negative.
"""

from __future__ import annotations

import math
import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel.models import PrimitiveModel
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import lower_builtin, lower_cast, overload, register_model

WIDTH = 8
"""Lanes of a vector."""
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_WORDS = ir.VectorType(ir.IntType(64), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_WORD = ir.IntType(64)
_FIRST, _EIGHT = ir.Constant(_WORD, 0), ir.Constant(_WORD, WIDTH)


class Lanes(types.Type):  # type: ignore[misc]
    """The numba type of a vector; it exists only inside compiled functions."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


@register_model(Lanes)
class _LanesModel(PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, _VECTOR)


_LANES, _MASK, _TABLE = Lanes(), types.int64, types.Array
_NUMBER, _INDEX = types.float64, types.intp


def _compiled_as(gives, *takes, key=None):
    """Decorate a function that generates code, for compiled code, or for vectors as `key`.

    Arguments are converted to the types that it `takes`; tables of any type stay unchanged.
    """

    def register(emit):
        class Template(AbstractTemplate):  # type: ignore[misc]
            def generic(self, arguments, keywords):
                of_vectors = _LANES in takes and _TABLE not in takes
                if len(arguments) != len(takes) or (of_vectors and _LANES not in arguments):
                    return None
                pairs = zip(arguments, takes, strict=True)
                return gives(*(own if kind is _TABLE else kind for own, kind in pairs))

        def lowered(context, builder, signature, values):
            values = [
                context.make_array(kind)(context, builder, value)
                if isinstance(kind, _TABLE)
                else value
                for kind, value in zip(signature.args, values, strict=True)
            ]
            made = emit(builder, *values)
            return context.get_dummy_value() if gives is types.none else made

        Template.key = key or emit
        infer_global(Template.key, types.Function(Template))
        lower_builtin(Template.key, *takes)(lowered)
        return emit

    return register


def _constant(kind, value):
    return ir.Constant(kind, [value] * WIDTH)


def _gathered(builder, kind, values):
    vector = ir.Constant(kind, ir.Undefined)
    for j, value in enumerate(values):
        vector = builder.insert_element(vector, value, ir.Constant(ir.IntType(32), j))
    return vector


def _shuffled(builder, a, b, order):
    indices = ir.VectorType(ir.IntType(32), WIDTH)
    return builder.shuffle_vector(a, b, ir.Constant(indices, list(order)))


def _called(name, reduces=False):
    """Return a function that calls an LLVM function on numbers or on vectors."""

    def call(builder, *values):
        kind = values[0].type
        full = f"llvm.{name}.v{WIDTH}f64" if kind == _VECTOR else f"llvm.{name}.f64"
        called = ir.FunctionType(kind.element if reduces else kind, [kind] * len(values))
        function = cgutils.get_or_insert_function(builder.module, called, full)
        # a reduction may assume that no lane is nan
        return builder.call(function, values, fastmath=("nnan",) if reduces else ())

    return call


def _compared(symbol):
    """Return a function that compares two vectors, and makes a mask."""

    def compare(builder, a, b):
        bits = builder.fcmp_ordered(symbol, a, b)
        return builder.zext(builder.bitcast(bits, ir.IntType(WIDTH)), _WORD)

    return compare


def _picked(symbol):
    """Return a function that picks one of several numbers in each lane, in rounds of pairs."""

    def pick(builder, *values):
        if len(values) == 1:
            return values[0]
        half = (len(values) + 1) // 2
        a, b = pick(builder, *values[:half]), pick(builder, *values[half:])
        return builder.select(builder.fcmp_ordered(symbol, a, b), a, b)

    return pick


def _arithmetic(symbol, emit):
    """Let compiled code write `symbol` between vectors, or a vector and a float.

    It is an inlined function; code emitted in place was 4 % slower at N = 6.
    """
    operation = _compiled_as(_LANES, _LANES, _LANES)(emit)

    @overload(symbol)
    def resolve(a, b):  # numba compares the two signatures
        if isinstance(a, Lanes) or isinstance(b, Lanes):
            return lambda a, b: operation(a, b)  # noqa: PLW0108 - numba wants a function
        return None


_arithmetic(operator.add, ir.IRBuilder.fadd)
_arithmetic(operator.sub, ir.IRBuilder.fsub)
_arithmetic(operator.mul, ir.IRBuilder.fmul)
_arithmetic(operator.truediv, ir.IRBuilder.fdiv)
for _key, _symbol in (
    (operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")
):  # fmt: skip
    _compiled_as(_MASK, _LANES, _LANES, key=_key)(_compared(_symbol))
for _count in (2, 3, 4):
    _compiled_as(_LANES, *[_LANES] * _count, key=min)(_picked("<"))
    _compiled_as(_LANES, *[_LANES] * _count, key=max)(_picked(">"))
_compiled_as(_LANES, _LANES, key=abs)(_called("fabs"))
_compiled_as(_LANES, _LANES, key=math.sqrt)(_called("sqrt"))

fused = _compiled_as(_LANES, _LANES, _LANES, _LANES)(_called("fma"))
"""Return a b + c, rounded once; also of three floats."""
_compiled_as(_NUMBER, _NUMBER, _NUMBER, _NUMBER, key=fused)(fused)
least = _compiled_as(_NUMBER, _LANES)(_called("vector.reduce.fmin", reduces=True))
"""Return the smallest lane, provided that none is nan."""
largest = _compiled_as(_NUMBER, _LANES)(_called("vector.reduce.fmax", reduces=True))
"""Return the largest lane, provided that none is nan."""
lane_of = _compiled_as(_NUMBER, _LANES, _INDEX)(ir.IRBuilder.extract_element)
"""Return lane j of a vector."""


@_compiled_as(_LANES, _NUMBER)
def spread(builder, value):
    """Return the vector with a number in all lanes."""
    first = _gathered(builder, _VECTOR, [value])
    return _shuffled(builder, first, first, [0] * WIDTH)


@lower_cast(types.Float, Lanes)
def _filled(context, builder, source, kind, value):
    return spread(builder, value)


@_compiled_as(_LANES, _MASK, _LANES, _LANES)
def choose(builder, mask, a, b):
    """Return lane by lane `a` where the mask is set, else `b`."""
    return builder.select(builder.bitcast(builder.trunc(mask, ir.IntType(WIDTH)), _BITS), a, b)


@_compiled_as(_LANES, _LANES)
def mantissa(builder, a):
    """Return m of a = m 2**e with m in [1/2, 1), for positive normal a."""
    fraction = builder.and_(builder.bitcast(a, _WORDS), _constant(_WORDS, 2**52 - 1))
    return builder.bitcast(builder.or_(fraction, _constant(_WORDS, 1022 << 52)), _VECTOR)


@_compiled_as(_LANES, _LANES)
def exponent(builder, a):
    """Return e of a = m 2**e, for positive normal a."""
    biased = builder.lshr(builder.bitcast(a, _WORDS), _constant(_WORDS, 52))
    return builder.sitofp(builder.sub(biased, _constant(_WORDS, 1022)), _VECTOR)


def _address(builder, table, row, column, width=_EIGHT):
    """Return the address of table[row, column], in a table of rows of eight or another width."""
    return builder.gep(table.data, [builder.add(builder.mul(row, width), column)])


def _eight(builder, table, row, column, *width):
    """Return the address of table[row, column : column + 8]."""
    address = _address(builder, table, row, column, *width)
    return builder.bitcast(address, _VECTOR.as_pointer())


@_compiled_as(_LANES, _TABLE, _INDEX, _INDEX)
def load(builder, table, row, column):
    """Return table[row, column : column + 8]."""
    width = builder.extract_value(table.shape, 1)
    return builder.load(_eight(builder, table, row, column, width), align=8)


@_compiled_as(types.none, _TABLE, _INDEX, _INDEX, _LANES)
def store(builder, table, row, column, vector):
    """Set table[row, column : column + 8] to `vector`."""
    width = builder.extract_value(table.shape, 1)
    builder.store(vector, _eight(builder, table, row, column, width), align=8)


@_compiled_as(_LANES, _TABLE, _INDEX)
def take(builder, table, row):
    """Return table[row]."""
    return builder.load(_eight(builder, table, row, _FIRST), align=8)


@_compiled_as(types.none, _TABLE, _INDEX, _LANES)
def put(builder, table, row, vector):
    """Set table[row] to `vector`."""
    builder.store(vector, _eight(builder, table, row, _FIRST), align=8)


@_compiled_as(_NUMBER, _TABLE, _INDEX, _INDEX)
def element(builder, table, row, lane):
    """Return table[row, lane]."""
    return builder.load(_address(builder, table, row, lane), align=8)


@_compiled_as(_LANES, _LANES, _LANES)
def from_left(builder, previous, a):
    """Return in lane j lane j - 1 of a, in lane 0 the last lane of `previous`."""
    return _shuffled(builder, previous, a, range(WIDTH - 1, 2 * WIDTH - 1))


@_compiled_as(_LANES, _LANES, _LANES)
def from_right(builder, a, following):
    """Return in lane j lane j + 1 of a, in the last the first lane of `following`."""
    return _shuffled(builder, a, following, range(1, WIDTH + 1))


@_compiled_as(_MASK, _MASK)
def lowest_bit(builder, mask):
    """Return the number of the lowest set bit of a mask that is not zero."""
    return builder.cttz(mask, ir.Constant(ir.IntType(1), 1))


@_compiled_as(_LANES, *[_NUMBER] * 4)
def together(builder, *values):
    """Return the vector of four floats; further lanes are zero."""
    zeros = [ir.Constant(ir.DoubleType(), 0.0)] * (WIDTH - len(values))
    return _gathered(builder, _VECTOR, [*values, *zeros])


@_compiled_as(_LANES, *[types.uint64] * WIDTH)
def upper_bits(builder, *words):
    """Return the upper 53 bits of eight uint64, as whole numbers."""
    shifted = builder.lshr(_gathered(builder, _WORDS, words), _constant(_WORDS, 11))
    return builder.sitofp(shifted, _VECTOR)


@_compiled_as(types.none)
def align_stack(builder):
    """Let the function that calls this keep its spilled vectors within cache lines."""
    builder.function.attributes.alignstack = 64
    builder.function.attributes.add("nounwind")  # alone the other is not written out
