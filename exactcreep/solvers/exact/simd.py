"""Eight sliders at a time: a vector of float64 for the compiled kernel.

Compiled loops over eight columns do not reliably become vector instructions; what is written with
`Lanes` does. Compiled functions add, subtract, multiply and divide such vectors, take ``abs``,
``math.sqrt``, ``min`` and ``max`` (the second argument where one is not a number), and compare
them. Comparing gives a mask, an integer whose bit j belongs to lane j. A float among the operands
stands for a vector whose lanes all hold it. The functions below do the rest.

Every operation is one IEEE operation per lane (`fused` rounds once), so that results do not depend
on the width of the machine's registers. `tests/solvers/exact/test_simd.py` holds them against NumPy
lane by lane. Tables are C-ordered, ``table[row]`` is of eight cells; no index is negative.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
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
_FIRST = ir.Constant(_WORD, 0)


class Lanes(types.Type):  # type: ignore[misc]
    """The numba type of a vector; it exists only inside compiled functions."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


_LANES = Lanes()


@register_model(Lanes)
class _LanesModel(PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, _VECTOR)


def _gathered(builder: Any, kind: Any, values: Sequence[Any]) -> Any:
    vector = ir.Constant(kind, ir.Undefined)
    for j, value in enumerate(values):
        vector = builder.insert_element(vector, value, ir.Constant(ir.IntType(32), j))
    return vector


def _shuffled(builder: Any, a: Any, b: Any, order: Sequence[int]) -> Any:
    indices = ir.VectorType(ir.IntType(32), WIDTH)
    return builder.shuffle_vector(a, b, ir.Constant(indices, list(order)))


@lower_cast(types.Float, Lanes)
def _filled(context: Any, builder: Any, source: Any, kind: Lanes, value: Any) -> Any:
    first = _gathered(builder, _VECTOR, [value])
    return _shuffled(builder, first, first, [0] * WIDTH)


def _called(builder: Any, name: str, *values: Any, reduces: bool = False) -> Any:
    """Call a function of LLVM on numbers or on vectors."""
    kind = values[0].type
    full = f"llvm.{name}.v{WIDTH}f64" if kind == _VECTOR else f"llvm.{name}.f64"
    called = ir.FunctionType(kind.element if reduces else kind, [kind] * len(values))
    function = cgutils.get_or_insert_function(builder.module, called, full)
    # a reduction need not look for lanes that are not numbers
    return builder.call(function, values, fastmath=("nnan",) if reduces else ())


def _define(key: Any, kind: Callable[..., Any], emit: Callable[..., Any], *takes: Any) -> None:
    """Let compiled code call `key` with arguments of the types, or kinds of types, `takes`.

    `kind` returns its signature, to whose types the arguments are converted, or None if it is not
    for these; `emit` builds the code.
    """

    class Template(AbstractTemplate):  # type: ignore[misc]
        def generic(self, arguments: Any, keywords: Any) -> Any:
            return kind(*arguments)

    def lowered(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        values = [
            context.make_array(of)(context, builder, value) if type(of) is types.Array else value
            for of, value in zip(signature.args, values, strict=True)
        ]
        made = emit(builder, *values)
        return context.get_dummy_value() if made is None else made

    Template.key = key
    infer_global(key, types.Function(Template))
    lower_builtin(key, *takes)(lowered)


def _function(kind: Callable[..., Any]) -> Callable[[Any], Any]:
    """Decorate what builds the code of a function for compiled code; see `_define`."""

    def register(emit: Any) -> Any:
        _define(emit, kind, emit, types.VarArg(types.Any))
        return emit

    return register


def _elementwise(*takes: Any, gives: Any = _LANES, key: Any = None) -> Callable[[Any], Any]:
    """Decorate what builds the code of a function, or of `key`, of vectors and masks.

    `takes` and what it `gives` are `_LANES` or, for a mask, `types.int64`.
    """

    def kind(*arguments: Any) -> Any:
        vectors = any(isinstance(argument, Lanes) for argument in arguments)
        return gives(*takes) if vectors and len(arguments) == len(takes) else None

    def register(emit: Any) -> Any:
        def each(builder: Any, *values: Any) -> Any:
            made = emit(builder, *(_bits(builder, value) for value in values))
            return made if gives is _LANES else _mask(builder, made)

        _define(key or emit, kind, each, *takes)
        return emit

    return register


def _bits(builder: Any, value: Any) -> Any:
    """Return the lanes' bits of a mask; a vector as it is."""
    if value.type != _WORD:
        return value
    return builder.bitcast(builder.trunc(value, ir.IntType(WIDTH)), _BITS)


def _mask(builder: Any, bits: Any) -> Any:
    return builder.zext(builder.bitcast(bits, ir.IntType(WIDTH)), _WORD)


def _picked(symbol: str) -> Callable[..., Any]:
    """Return what picks one of several numbers in each lane, in rounds of pairs."""

    def pick(builder: Any, *values: Any) -> Any:
        if len(values) == 1:
            return values[0]
        half = (len(values) + 1) // 2
        a, b = pick(builder, *values[:half]), pick(builder, *values[half:])
        return builder.select(builder.fcmp_ordered(symbol, a, b), a, b)

    return pick


def _arithmetic(symbol: Any, emit: Callable[..., Any]) -> None:
    """Let compiled code write `symbol` between vectors, or a vector and a float.

    As a function of its own, which is then inlined: code emitted in place was 4 % slower at N = 6.
    """
    operation = _elementwise(_LANES, _LANES)(emit)

    @overload(symbol)
    def resolve(a, b):  # numba compares the two signatures
        if isinstance(a, Lanes) or isinstance(b, Lanes):
            return lambda a, b: operation(a, b)  # noqa: PLW0108 - numba wants a function
        return None


_arithmetic(operator.add, ir.IRBuilder.fadd)
_arithmetic(operator.sub, ir.IRBuilder.fsub)
_arithmetic(operator.mul, ir.IRBuilder.fmul)
_arithmetic(operator.truediv, ir.IRBuilder.fdiv)
for _count in (2, 3, 4):
    _elementwise(*[_LANES] * _count, key=min)(_picked("<"))
    _elementwise(*[_LANES] * _count, key=max)(_picked(">"))
for _key, _symbol in (
    (operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")
):  # fmt: skip
    _elementwise(_LANES, _LANES, gives=types.int64, key=_key)(
        lambda builder, a, b, symbol=_symbol: builder.fcmp_ordered(symbol, a, b)
    )
_elementwise(_LANES, key=abs)(lambda builder, a: _called(builder, "fabs", a))
_elementwise(_LANES, key=math.sqrt)(lambda builder, a: _called(builder, "sqrt", a))


@_elementwise(types.int64, _LANES, _LANES)
def choose(builder: Any, mask: Any, a: Any, b: Any) -> Any:
    """Return lane by lane `a` where the mask is set, else `b`."""
    return builder.select(mask, a, b)


@_elementwise(_LANES, _LANES, _LANES)
def fused(builder: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a b + c, rounded once; also of three floats."""
    return _called(builder, "fma", a, b, c)


def _of_floats(*arguments: Any) -> Any:
    if any(isinstance(argument, Lanes) for argument in arguments):
        return None
    return types.float64(*arguments)


_define(fused, _of_floats, fused, *[types.Float] * 3)


@_elementwise(_LANES)
def mantissa(builder: Any, a: Any) -> Any:
    """Return m of a = m 2**e with m in [1/2, 1), for positive normal a."""
    bits = builder.bitcast(a, _WORDS)
    fraction = builder.and_(bits, ir.Constant(_WORDS, [2**52 - 1] * WIDTH))
    half = ir.Constant(_WORDS, [1022 << 52] * WIDTH)
    return builder.bitcast(builder.or_(fraction, half), _VECTOR)


@_elementwise(_LANES)
def exponent(builder: Any, a: Any) -> Any:
    """Return e of a = m 2**e, for positive normal a."""
    biased = builder.lshr(builder.bitcast(a, _WORDS), ir.Constant(_WORDS, [52] * WIDTH))
    return builder.sitofp(builder.sub(biased, ir.Constant(_WORDS, [1022] * WIDTH)), _VECTOR)


def _cell(builder: Any, table: Any, row: Any, column: Any) -> Any:
    """Return the address of table[row, column]."""
    width = builder.extract_value(table.shape, 1)
    return builder.gep(table.data, [builder.add(builder.mul(row, width), column)])


def _lane(builder: Any, table: Any, row: Any, lane: Any) -> Any:
    """Return the address of table[row, lane], in a table of rows of eight."""
    first = builder.mul(row, ir.Constant(_WORD, WIDTH))
    return builder.gep(table.data, [builder.add(first, lane)])


def _read(builder: Any, address: Any) -> Any:
    return builder.load(builder.bitcast(address, _VECTOR.as_pointer()), align=8)


def _write(builder: Any, vector: Any, address: Any) -> None:
    builder.store(vector, builder.bitcast(address, _VECTOR.as_pointer()), align=8)


@_function(lambda table, row, column: _LANES(table, types.intp, types.intp))
def load(builder: Any, table: Any, row: Any, column: Any) -> Any:
    """Return table[row, column : column + 8]."""
    return _read(builder, _cell(builder, table, row, column))


@_function(lambda table, row, column, vector: types.none(table, types.intp, types.intp, _LANES))
def store(builder: Any, table: Any, row: Any, column: Any, vector: Any) -> None:
    """Set table[row, column : column + 8] to `vector`."""
    _write(builder, vector, _cell(builder, table, row, column))


@_function(lambda table, row: _LANES(table, types.intp))
def take(builder: Any, table: Any, row: Any) -> Any:
    """Return table[row]."""
    return _read(builder, _lane(builder, table, row, _FIRST))


@_function(lambda table, row, vector: types.none(table, types.intp, _LANES))
def put(builder: Any, table: Any, row: Any, vector: Any) -> None:
    """Set table[row] to `vector`."""
    _write(builder, vector, _lane(builder, table, row, _FIRST))


@_function(lambda table, row, lane: types.float64(table, types.intp, types.intp))
def element(builder: Any, table: Any, row: Any, lane: Any) -> Any:
    """Return table[row, lane]."""
    return builder.load(_lane(builder, table, row, lane), align=8)


@_function(lambda value: _LANES(_LANES))
def spread(builder: Any, value: Any) -> Any:
    """Return the vector whose lanes all hold a number."""
    return value


@_elementwise(_LANES, _LANES)
def from_left(builder: Any, previous: Any, a: Any) -> Any:
    """Return in lane j lane j - 1 of a, in lane 0 the last lane of `previous`."""
    return _shuffled(builder, previous, a, range(WIDTH - 1, 2 * WIDTH - 1))


@_elementwise(_LANES, _LANES)
def from_right(builder: Any, a: Any, following: Any) -> Any:
    """Return in lane j lane j + 1 of a, in the last the first lane of `following`."""
    return _shuffled(builder, a, following, range(1, WIDTH + 1))


@_function(lambda a: types.float64(_LANES))
def least(builder: Any, a: Any) -> Any:
    """Return the smallest of the lanes, all of which are numbers."""
    return _called(builder, "vector.reduce.fmin", a, reduces=True)


@_function(lambda a: types.float64(_LANES))
def largest(builder: Any, a: Any) -> Any:
    """Return the largest of the lanes, all of which are numbers."""
    return _called(builder, "vector.reduce.fmax", a, reduces=True)


@_function(lambda a, j: types.float64(_LANES, types.intp))
def lane_of(builder: Any, a: Any, j: Any) -> Any:
    """Return lane j of a vector."""
    return builder.extract_element(a, j)


@_function(lambda mask: types.int64(types.int64))
def lowest_bit(builder: Any, mask: Any) -> Any:
    """Return the number of the lowest set bit of a mask that is not zero."""
    return builder.cttz(mask, ir.Constant(ir.IntType(1), 1))


@_function(lambda *values: _LANES(*[types.float64] * len(values)))
def together(builder: Any, *values: Any) -> Any:
    """Return the vector of up to eight floats; further lanes are zero."""
    zeros = [ir.Constant(ir.DoubleType(), 0.0)] * (WIDTH - len(values))
    return _gathered(builder, _VECTOR, [*values, *zeros])


@_function(lambda *words: _LANES(*[types.uint64] * WIDTH))
def upper_bits(builder: Any, *words: Any) -> Any:
    """Return the upper 53 bits of eight uint64, as whole numbers."""
    gathered = _gathered(builder, _WORDS, words)
    shifted = builder.lshr(gathered, ir.Constant(_WORDS, [11] * WIDTH))
    return builder.sitofp(shifted, _VECTOR)


@_function(types.none)
def align_stack(builder: Any) -> None:
    """Let the function that calls this keep its spilled vectors within cache lines."""
    builder.function.attributes.alignstack = 64
    builder.function.attributes.add("nounwind")  # alone the other is not written out
