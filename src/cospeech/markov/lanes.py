"""Vectors of ``LANES`` float64 for compiled kernels.

Whether a compiler vectorises a loop over scalars is a matter of luck; these vectors are explicit. A vector is loaded
from the last axis of an array, which has the length ``LANES``, and stored there; in between it is used like a float,
also together with floats. Products and sums are fused where the processor can.
"""

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.core import cgutils
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model

from cospeech.kernels.jit import njit

intrinsic: Any = extending.intrinsic  # its own type counts what numba passes among the arguments of a call

LANES = 8
"""Two registers of AVX2, or one of AVX-512; on other processors the compiler chooses."""

FUSE = ("contract",)
"""Fast-math flags of all arithmetic: a product and a sum may be rounded once."""

LEAST = -990.0
TINY = 2.0**LEAST
"""The minimum of ``exp2``: smaller values are replaced by it."""

ROUND = 1.5 * 2.0**52
"""Added to a number, this puts its nearest integer into the last bits of the sum."""

WIDE, INTS = (ir.VectorType(kind, LANES) for kind in (ir.DoubleType(), ir.IntType(64)))


class Lanes(types.Type):
    """The numba type of a vector."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


lanes = Lanes()


@register_model(Lanes)
class LanesModel(models.PrimitiveModel):
    """A vector is one LLVM value in a register."""

    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, WIDE)


def _wide(builder: Any, value: Any) -> Any:
    """Return a vector as it is, and a float as a vector with it in every lane."""
    if value.type == WIDE:
        return value
    one = builder.insert_element(ir.Constant(WIDE, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), None)
    return builder.shuffle_vector(one, ir.Constant(WIDE, ir.Undefined), zeros)


def _operator(function: Any, method: str) -> None:
    """Register an operation on two vectors, or on a vector and a float, with numba."""
    pairs = ((lanes, lanes), (lanes, types.float64), (types.float64, lanes))

    def lower(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        left, right = (_wide(builder, argument) for argument in arguments)
        return getattr(builder, method)(left, right, flags=FUSE)

    infer_global(function)(
        type("Template", (ConcreteTemplate,), {"cases": [signature(lanes, *pair) for pair in pairs]})
    )
    for pair in pairs:
        lower_builtin(function, *pair)(lower)


for _function, _method in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul")):
    _operator(_function, _method)


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, index_type: Any, index: Any) -> Any:
    """Return the address of the vector ``array[index]``; ``index`` is of all axes but the last."""
    fields = context.make_array(array_type)(context, builder, array)
    places = [
        context.cast(builder, place, of, types.intp)
        for place, of in zip(cgutils.unpack_tuple(builder, index), index_type, strict=True)
    ]
    places.append(context.get_constant(types.intp, 0))
    # The known length of the last axis simplifies the calculation of addresses in loops.
    shape = [*cgutils.unpack_tuple(builder, fields.shape)[:-1], context.get_constant(types.intp, LANES)]
    strides = cgutils.unpack_tuple(builder, fields.strides)
    place = cgutils.get_item_pointer2(context, builder, fields.data, shape, strides, "C", places)
    return builder.bitcast(place, WIDE.as_pointer())


@intrinsic
def take(_typing: Any, array: Any, index: Any) -> Any:
    """Return the vector ``array[index]``, ``index`` a tuple of all axes but the last; bounds are not checked."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pairs = zip(signature.args, arguments, strict=True)
        return builder.load(_pointer(context, builder, *(part for pair in pairs for part in pair)), align=8)

    return lanes(array, index), generate


@intrinsic
def put(_typing: Any, array: Any, index: Any, _value: Any) -> Any:
    """Store a vector in ``array[index]``; see ``take``."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pairs = zip(signature.args[:2], arguments[:2], strict=True)
        builder.store(arguments[2], _pointer(context, builder, *(part for pair in pairs for part in pair)), align=8)
        return context.get_dummy_value()

    return types.void(array, index, lanes), generate


@intrinsic
def each(_typing: Any, _value: Any) -> Any:
    """Return a vector with ``value`` in every lane."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return _wide(builder, arguments[0])

    return lanes(types.float64), generate


@intrinsic
def where_greater(_typing: Any, _a: Any, _b: Any, _yes: Any, _no: Any) -> Any:
    """Return ``yes`` in the lanes where a > b, else ``no``."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        a, b, yes, no = arguments
        return builder.select(builder.fcmp_ordered(">", a, b), yes, no)

    return lanes(lanes, lanes, lanes, lanes), generate


@njit(inline="always")
def greater(a: Any, b: Any) -> Any:
    """Return the greater value in each lane, that of ``b`` if they are not ordered."""
    return where_greater(a, b, a, b)


def _reduce(builder: Any, value: Any, combine: Any) -> Any:
    """Return the lanes of a vector combined into one number, by halves, quarters and so on, always in this order."""
    width = LANES
    while width > 1:
        width //= 2
        low, high = (
            builder.shuffle_vector(value, value, ir.Constant(ir.VectorType(ir.IntType(32), width), list(part)))
            for part in (range(width), range(width, 2 * width))
        )
        value = combine(low, high)
    return builder.extract_element(value, ir.Constant(ir.IntType(32), 0))


@intrinsic
def total(_typing: Any, _value: Any) -> Any:
    """Return the sum of the lanes of a vector."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return _reduce(builder, arguments[0], builder.fadd)

    return types.float64(lanes), generate


@intrinsic
def greatest(_typing: Any, _value: Any) -> Any:
    """Return the greatest lane of a vector."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        return _reduce(builder, arguments[0], lambda a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b))

    return types.float64(lanes), generate


@intrinsic
def first_lane(_typing: Any, _value: Any, _sought: Any) -> Any:
    """Return the index of the first lane that equals ``sought``, at least ``LANES`` if none does."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        value, sought = arguments
        equal = builder.bitcast(builder.fcmp_ordered("==", value, _wide(builder, sought)), ir.IntType(LANES))
        wide = builder.zext(equal, ir.IntType(64))
        return builder.cttz(wide, ir.Constant(ir.IntType(1), 0))

    return types.int64(lanes, types.float64), generate


@intrinsic
def _times_power(_typing: Any, _value: Any, _shifted: Any) -> Any:
    """Return ``value`` times 2 to the power of the integer in the last bits of ``shifted``."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        value, shifted = (builder.bitcast(argument, INTS) for argument in arguments)
        bits = builder.add(value, builder.shl(shifted, ir.Constant(INTS, [52] * LANES)))
        return builder.bitcast(bits, WIDE)

    return lanes(lanes, lanes), generate


@njit(inline="always")
def exp2(x: Any) -> Any:
    """Return 2^x for x <= 1000, at least ``TINY``, to a relative error of 5e-16.

    A polynomial of degree 10 (interpolated at Chebyshev nodes) on [-1/2, 1/2]; the integer part is added to the
    exponent bits. It is evaluated in pairs (Estrin), because the ten steps of Horner's scheme depend on each other.
    """
    x = greater(x, each(LEAST))
    shifted = x + ROUND
    r = x - (shifted - ROUND)
    r2 = r * r
    r4 = r2 * r2
    low = (r * 0.69314718055995 + 1.0) + r2 * (r * 0.05550410866444772 + 0.24022650695910097)
    middle = (r * 0.0013333558230164974 + 0.009618129107606888) + r2 * (
        r * 1.5252657260200837e-05 + 0.0001540353044173605
    )
    high = (r * 1.0208690299958306e-07 + 1.321544258792169e-06) + r2 * 7.072585949269223e-09
    p = low + r4 * (middle + r4 * high)
    return _times_power(p, shifted)
