"""Eight float32 at once, in compiled kernels: what LLVM does not find by itself without fast-math.

`load(array, at)` is the eight values of a flat float32 array from `at` on, `store` puts them back, `fill` repeats a
number, `total` adds the eight up in a fixed order, `highest` is the largest. `+ - * /` work on them, `least` and `most`
take the smaller and the larger ones, and `where_less(a, b, x, y)` takes x where a < b, else y.
All is IEEE arithmetic: results are the same on each CPU.
"""

# numba has no types:
# mypy: disable-error-code="no-untyped-call,no-untyped-def,misc,untyped-decorator"

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import extending, types
from numba.extending import models, overload, register_model

from facefolds_core.kernels.jit import inlined

intrinsic: Any = extending.intrinsic  # for numba's own types the typing context is an argument of the caller's

LANES = 8


class _Lanes(types.Type):
    """numba's type of eight float32."""

    def __init__(self) -> None:
        super().__init__(name="Lanes8")


LANES_TYPE = _Lanes()
VECTOR = ir.VectorType(ir.FloatType(), LANES)


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, numba_type: Any) -> None:
        super().__init__(manager, numba_type, VECTOR)


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, at: Any) -> Any:
    """Of eight neighbours in a contiguous float32 array."""
    data = context.make_array(array_type)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [at]), VECTOR.as_pointer())


@intrinsic
def load(typing: Any, array: Any, at: Any) -> Any:
    """array[at : at + 8] of a flat float32 array."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        at = context.cast(builder, arguments[1], signature.args[1], types.intp)
        return builder.load(_pointer(context, builder, signature.args[0], arguments[0], at), align=4)

    return LANES_TYPE(array, at), build


@intrinsic
def store(typing: Any, array: Any, at: Any, values: Any) -> Any:
    """array[at : at + 8] = values."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        at = context.cast(builder, arguments[1], signature.args[1], types.intp)
        pointer = _pointer(context, builder, signature.args[0], arguments[0], at)
        builder.store(arguments[2], pointer, align=4)
        return context.get_dummy_value()

    return types.void(array, at, values), build


def _filled(builder: Any, value: Any) -> Any:
    undefined = ir.Constant(VECTOR, ir.Undefined)
    one = builder.insert_element(undefined, value, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, undefined, zeros)


@intrinsic
def fill(typing: Any, value: Any) -> Any:
    """Eight times a number."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _filled(builder, context.cast(builder, arguments[0], signature.args[0], types.float32))

    return LANES_TYPE(value), build


@intrinsic
def where_less(typing: Any, a: Any, b: Any, x: Any, y: Any) -> Any:
    """x where a < b, else y."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        a, b, x, y = arguments
        return builder.select(builder.fcmp_ordered("<", a, b), x, y)

    return LANES_TYPE(a, b, x, y), build


def _halves(builder: Any, values: Any, size: int) -> tuple[Any, Any]:
    """Both halves of a vector, (2 size,) -> (size,)."""
    undefined = ir.Constant(values.type, ir.Undefined)
    masks = (ir.Constant(ir.VectorType(ir.IntType(32), size), list(range(start, start + size))) for start in (0, size))
    first, second = (builder.shuffle_vector(values, undefined, mask) for mask in masks)
    return first, second


@intrinsic
def total(typing: Any, values: Any) -> Any:
    """The sum of the eight: of halves, then of their halves."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        left = arguments[0]
        for size in (4, 2, 1):
            left = builder.fadd(*_halves(builder, left, size))
        return builder.extract_element(left, ir.Constant(ir.IntType(32), 0))

    return types.float32(values), build


@intrinsic
def highest(typing: Any, values: Any) -> Any:
    """The largest of the eight."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        left = arguments[0]
        for size in (4, 2, 1):
            one, two = _halves(builder, left, size)
            left = builder.select(builder.fcmp_ordered("<", one, two), two, one)
        return builder.extract_element(left, ir.Constant(ir.IntType(32), 0))

    return types.float32(values), build


def _binary(name: str) -> Any:
    @intrinsic
    def apply(typing: Any, a: Any, b: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return getattr(builder, name)(*arguments)

        return LANES_TYPE(a, b), build

    return apply


def _overload(symbol: Any, name: str) -> None:
    apply = _binary(name)

    @overload(symbol)
    def choose(a, b):
        if isinstance(a, _Lanes) and isinstance(b, _Lanes):
            return lambda a, b: apply(a, b)
        if isinstance(a, _Lanes) and isinstance(b, types.Number):
            return lambda a, b: apply(a, fill(b))
        if isinstance(a, types.Number) and isinstance(b, _Lanes):
            return lambda a, b: apply(fill(a), b)
        return None


for _symbol, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _overload(_symbol, _name)


@inlined
def least(a, b):
    """The smaller ones."""
    return where_less(a, b, a, b)


@inlined
def most(a, b):
    """The larger ones."""
    return where_less(a, b, b, a)
