"""Numbers side by side: what compiled code computes with the vectors of the processor.

``Lanes`` is as many numbers as fill one vector of 512 bits, 16 of float32 or 8 of float64, and as
many of any other type next to them. Operators act on all lanes at once; a plain number with lanes
takes their precision. A comparison gives a mask, by which ``where``
chooses. Where the processor has shorter vectors, the compiler takes several for one.

An array of lanes has shape (rows, lanes), C order.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

COUNT = {"float32": 16, "float64": 8}
"""Lanes of a run of each precision."""


class Lanes(types.Type):
    """Numba's type of so many numbers of a type."""

    def __init__(self, kind: Any, count: int) -> None:
        self.kind, self.count = kind, count
        super().__init__(name=f"lanes({kind} x {count})")


@register_model(Lanes)
class _Model(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, _vector(kind))


def _vector(lanes: Lanes) -> ir.VectorType:
    numbers = {"float32": ir.FloatType(), "float64": ir.DoubleType(), "bool": ir.IntType(1)}
    return ir.VectorType(numbers[str(lanes.kind)], lanes.count)


def _splat(builder: Any, number: Any, vector: ir.VectorType) -> Any:
    """A vector that has the same number in each lane."""
    index = ir.IntType(32)
    first = builder.insert_element(ir.Constant(vector, ir.Undefined), number, index(0))
    everywhere = ir.Constant(ir.VectorType(index, vector.count), [0] * vector.count)
    return builder.shuffle_vector(first, ir.Constant(vector, ir.Undefined), everywhere)


def _as_lanes(context: Any, builder: Any, value: Any, kind: Any, wanted: Lanes) -> Any:
    if isinstance(kind, Lanes):
        return value
    return _splat(builder, context.cast(builder, value, kind, wanted.kind), _vector(wanted))


def _operator(function: Any, result: Callable[[Lanes], Lanes], build: Any) -> None:
    """Define an operator of two lanes, or of lanes and a plain number."""

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            assert not kws
            lanes = [kind for kind in args if isinstance(kind, Lanes)]
            fit = [isinstance(kind, types.Float) or kind == lanes[0] for kind in args if lanes]
            return (
                signature(result(lanes[0]), *args) if len(args) == 2 and all(fit) and fit else None
            )

    infer_global(function)(Template)

    def lowered(context: Any, builder: Any, of: Any, arguments: Any) -> Any:
        wanted = next(kind for kind in of.args if isinstance(kind, Lanes))
        both = [
            _as_lanes(context, builder, value, kind, wanted)
            for value, kind in zip(arguments, of.args, strict=True)
        ]
        return build(builder, *both)

    for pair in ((Lanes, Lanes), (Lanes, types.Float), (types.Float, Lanes)):
        lower_builtin(function, *pair)(lowered)


@infer_global(operator.invert)
class _Inverse(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        assert not kws
        is_mask = isinstance(args[0], Lanes) and args[0].kind == types.boolean
        return signature(args[0], *args) if is_mask else None


def _inverted(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
    return builder.not_(*arguments)


lower_builtin(operator.invert, Lanes)(_inverted)


def _built_in(function: Any) -> Any:
    """A function that compiled code may call, from what gives its type and builds its code."""
    return intrinsic(function)


def _mask(lanes: Lanes) -> Lanes:
    return Lanes(types.boolean, lanes.count)


for _function, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _operator(_function, lambda lanes: lanes, lambda b, x, y, n=_name: getattr(b, n)(x, y))

for _function, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
):
    _operator(_function, _mask, lambda b, x, y, s=_sign: b.fcmp_ordered(s, x, y))

_operator(operator.and_, lambda lanes: lanes, lambda b, x, y: b.and_(x, y))
_operator(operator.or_, lambda lanes: lanes, lambda b, x, y: b.or_(x, y))
_operator(operator.xor, lambda lanes: lanes, lambda b, x, y: b.xor(x, y))


@_built_in
def zero_lanes(_: Any, like: Any) -> Any:
    """Lanes of 0, in the precision of an array."""
    lanes = Lanes(like.dtype, COUNT[str(like.dtype)])

    def lowered(*_: Any) -> Any:
        return ir.Constant(_vector(lanes), [0.0] * lanes.count)

    return lanes(like), lowered


def _row(context: Any, builder: Any, kind: Any, array: Any, row: Any, lanes: Lanes) -> Any:
    """Pointer to a row of an array."""
    data = context.make_array(kind)(context, builder, array).data
    start = builder.mul(row, ir.Constant(row.type, lanes.count))
    return builder.bitcast(builder.gep(data, [start]), _vector(lanes).as_pointer())


@_built_in
def load(_: Any, array: Any, __: Any, like: Any) -> Any:
    """A row of an array, in its own precision, as many lanes as ``like`` has."""
    lanes = Lanes(array.dtype, like.count)

    def lowered(context: Any, builder: Any, of: Any, arguments: Any) -> Any:
        place = _row(context, builder, of.args[0], arguments[0], arguments[1], lanes)
        return builder.load(place, align=array.dtype.bitwidth // 8)

    return lanes(array, types.intp, like), lowered


@_built_in
def store(_: Any, array: Any, __: Any, value: Any) -> Any:
    """Write lanes into a row of an array of their precision."""

    def lowered(context: Any, builder: Any, of: Any, arguments: Any) -> Any:
        place = _row(context, builder, of.args[0], arguments[0], arguments[1], value)
        builder.store(arguments[2], place, align=array.dtype.bitwidth // 8)
        return context.get_dummy_value()

    return types.void(array, types.intp, value), lowered


@_built_in
def where(_: Any, mask: Any, yes: Any, no: Any) -> Any:
    """Take ``yes`` where the mask holds and ``no`` elsewhere."""

    def lowered(context: Any, builder: Any, of: Any, arguments: Any) -> Any:
        chosen, one, other = arguments
        one = _as_lanes(context, builder, one, of.args[1], of.return_type)
        other = _as_lanes(context, builder, other, of.args[2], of.return_type)
        return builder.select(chosen, one, other)

    return (yes if isinstance(yes, Lanes) else no)(mask, yes, no), lowered


def _of_each(name: str) -> Any:
    """A function of each lane, which the processor has."""

    def typed(_: Any, value: Any) -> Any:
        def lowered(__: Any, builder: Any, ___: Any, arguments: Any) -> Any:
            vector = _vector(value)
            function = cgutils.get_or_insert_function(
                builder.module,
                ir.FunctionType(vector, [vector]),
                f"llvm.{name}.v{value.count}f{value.kind.bitwidth}",
            )
            return builder.call(function, arguments)

        return value(value), lowered

    return typed


root: Any = intrinsic(_of_each("sqrt"))
magnitude: Any = intrinsic(_of_each("fabs"))


@_built_in
def same_precision(_: Any, value: Any, like: Any) -> Any:
    """Numbers in the precision of ``like``."""
    lanes = Lanes(like.kind, value.count)

    def lowered(__: Any, builder: Any, ___: Any, arguments: Any) -> Any:
        if lanes == value:
            return arguments[0]
        narrower = lanes.kind.bitwidth < value.kind.bitwidth
        convert = builder.fptrunc if narrower else builder.fpext
        return convert(arguments[0], _vector(lanes))

    return lanes(value, like), lowered


@_built_in
def bits(_: Any, mask: Any) -> Any:
    """A mask as an integer: bit k is that of lane k."""

    def lowered(__: Any, builder: Any, ___: Any, arguments: Any) -> Any:
        together = builder.bitcast(arguments[0], ir.IntType(mask.count))
        return builder.zext(together, ir.IntType(64))

    return types.uint64(mask), lowered


@_built_in
def number_of(_: Any, like: Any) -> Any:
    """How many lanes there are."""

    def lowered(*_: Any) -> Any:
        return ir.Constant(ir.IntType(64), like.count)

    return types.intp(like), lowered
