"""Operations that numba does not offer, as LLVM instructions: arrays and code at addresses, products of strips of four.

With numba switched off each is plain Python.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from math import prod
from operator import attrgetter
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import get_cython_function_address, intrinsic, models, register_model
from numba.np.arrayobj import populate_array

from gearrattle.engine.kernels._jit import inlined, is_compiling


def _to_pointer(_context: Any, address: Any) -> Any:
    """An address as a pointer."""

    def write(_: Any, builder: Any, __: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], cgutils.voidptr_t)

    return numba.types.voidptr(address), write


_pointer: Any = intrinsic(_to_pointer)
_carray: Any = numba.carray  # type: ignore[attr-defined]


def _compiled_array(address, shape, kind):  # type: ignore[no-untyped-def]
    """The array of a shape and type that lies at an address."""
    return _carray(_pointer(address), shape, kind)


def _plain_array(address: int, shape: tuple[int, ...], kind: type) -> Any:
    size = prod(map(int, shape)) * np.dtype(kind).itemsize
    bytes_there: Any = (ctypes.c_char * size).from_address(int(address))
    return np.ndarray(shape, kind, bytes_there)


array_at: Any = inlined(_compiled_array) if is_compiling() else _plain_array
"""The array of a shape and type that lies at an address: ``array_at(address, shape, kind)``."""


class _Group(numba.types.Type):
    """A NamedTuple of arrays in compiled code: a pointer to words that hold address and shape of each in turn."""

    def __init__(self, name: str, sample: Any) -> None:
        super().__init__(name=f"group of arrays {name}")
        kinds = dict(zip(sample._fields, map(numba.typeof, sample), strict=True))
        first = np.cumsum([0, *(1 + array.ndim for array in sample)]).tolist()
        self.arrays = {field: (kind, word) for (field, kind), word in zip(kinds.items(), first[:-1], strict=True)}


@register_model(_Group)
class _GroupModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, ir.IntType(64).as_pointer())


class _GroupArrays(AttributeTemplate):
    key = _Group

    def generic_resolve(self, group: Any, field: str) -> Any:  # type: ignore[override]
        return group.arrays[field][0] if field in group.arrays else None


def _array_of(context: Any, builder: Any, group: Any, words: Any, field: str) -> Any:
    """The array whose address and shape stand at its words; these never change, so a loop reads them once."""
    kind, first = group.arrays[field]
    array = context.make_array(kind)(context, builder)
    size = ir.IntType(64)(kind.dtype.bitwidth // 8)

    def word(i: int) -> Any:
        value = builder.load(builder.gep(words, [ir.IntType(64)(first + i)]))
        value.set_metadata("invariant.load", builder.module.add_metadata([]))
        return value

    shape = [word(1 + i) for i in range(kind.ndim)]
    strides = [size]
    for length in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], length))
    data = builder.inttoptr(word(0), array.data.type)
    populate_array(array, data=data, shape=shape, strides=strides, itemsize=size, meminfo=None)
    return array._getvalue()


infer_getattr(_GroupArrays)
lower_getattr_generic(_Group)(_array_of)


def group_reader(name: str, sample: Any, first: int) -> Any:
    """A kernel ``read(words)`` of a NamedTuple of arrays: words[first:] are address and shape of each in turn.

    Arrays that are not used cost nothing.

    name: of the NamedTuple, in what stands for the words with numba switched off.
    sample: such a NamedTuple, for the types.
    """
    group = _Group(name, sample)

    def read(_context: Any, words: Any) -> Any:
        def write(context: Any, builder: Any, signature: Any, operands: Any) -> Any:
            entry = context.make_array(signature.args[0])(context, builder, operands[0]).data
            return builder.gep(entry, [ir.IntType(64)(first)])

        return group(words), write

    return intrinsic(read) if is_compiling() else attrgetter(name)


_C_TYPES: dict[Any, Any] = {
    numba.void: None,
    numba.int32: ctypes.c_int32,
    numba.intp: ctypes.c_void_p,
    numba.float64: ctypes.c_double,
}
"""Type of an answer -> what ctypes calls it."""


def _foreign(result: Any) -> Any:
    """A kernel ``call(address, values)`` of the C function at an address: doubles, integers and pointers."""

    def plain(address: int, values: tuple[float, ...]) -> Any:
        kinds = [ctypes.c_double if isinstance(value, float) else ctypes.c_void_p for value in values]
        arguments = (value if isinstance(value, float) else int(value) for value in values)
        return ctypes.CFUNCTYPE(_C_TYPES[result], *kinds)(int(address))(*arguments)

    @intrinsic
    def call(_context: Any, address: Any, values: Any) -> Any:
        def write(context: Any, builder: Any, signature: Any, operands: Any) -> Any:
            types = [context.get_value_type(kind) for kind in signature.args[1]]
            shape = ir.FunctionType(context.get_value_type(result), types)
            function = builder.inttoptr(operands[0], shape.as_pointer())
            return builder.call(function, cgutils.unpack_tuple(builder, operands[1]))

        return result(address, values), write

    return call if is_compiling() else plain


def _native(result: Any) -> Any:
    """A kernel ``call(address, values)`` of compiled code of this package at an address (``address_of``)."""

    def plain(function: Callable[..., Any], values: tuple[Any, ...]) -> Any:
        return function(*values)

    @intrinsic
    def call(_context: Any, address: Any, values: Any) -> Any:
        kinds = [numba.types.unliteral(kind) for kind in values.types]

        def write(context: Any, builder: Any, _: Any, operands: Any) -> Any:
            shape = context.call_conv.get_function_type(result, kinds)
            function = builder.inttoptr(operands[0], shape.as_pointer())
            triples = zip(cgutils.unpack_tuple(builder, operands[1]), values.types, kinds, strict=True)
            handed = [context.cast(builder, value, kind, plain) for value, kind, plain in triples]
            return context.call_conv.call_function(builder, function, result, kinds, handed)[1]

        return result(address, values), write

    return call if is_compiling() else plain


_FOUR: Any = ir.VectorType(ir.DoubleType(), 4)


def _group(
    builder: Any, count: int, at: Any, stride: Any, apart: Any, columns: Any, weights: Any, out: Any, adds: bool
) -> None:
    """Write the sums of so many strips side by side: every weight is read once, and no sum waits for another."""
    integer = stride.type
    four = _FOUR.as_pointer()
    lane = ir.IntType(32)
    places = [builder.bitcast(builder.gep(out, [integer(4 * s)]), four) for s in range(count)]
    strips = [builder.gep(at, [builder.mul(stride, integer(s))]) for s in range(count)]
    sums = [cgutils.alloca_once(builder, _FOUR) for _ in range(count)]
    for pointer, total in zip(places, sums, strict=True):
        builder.store(builder.load(pointer, align=8) if adds else _FOUR([0.0] * 4), total)
    with cgutils.for_range(builder, columns) as loop:
        weight = builder.insert_element(_FOUR(ir.Undefined), builder.load(builder.gep(weights, [loop.index])), lane(0))
        spread = builder.shuffle_vector(weight, _FOUR(ir.Undefined), ir.VectorType(lane, 4)([0] * 4))
        for strip, total in zip(strips, sums, strict=True):
            column = builder.gep(strip, [builder.mul(loop.index, apart)])
            rows = builder.load(builder.bitcast(column, four), align=8)
            product = builder.fmul(rows, spread, flags=("contract",))
            builder.store(builder.fadd(builder.load(total), product, flags=("contract",)), total)
    for pointer, total in zip(places, sums, strict=True):
        builder.store(builder.load(total), pointer, align=8)


def _strip_product(adds: bool) -> Any:
    """A kernel that multiplies strips of four rows with a vector, see ``products``: in vectors of four by itself."""

    # the same in Python, with numba switched off
    def plain(stack: Any, where: tuple[int, int, int, int, int], y: Any, out: Any, at: int) -> None:
        (first, stride, apart, strips, columns) = where
        flat = stack.reshape(-1)
        for i in range(strips):
            begin = first + i * stride
            for r in range(4):
                sums = out[at + 4 * i + r] if adds else 0.0
                for j in range(columns):
                    sums += flat[begin + apart * j + r] * y[j]
                out[at + 4 * i + r] = sums

    # as LLVM instructions
    def product(_: Any, stack: Any, where: Any, y: Any, out: Any, at: Any) -> Any:
        def write(context: Any, builder: Any, signature: Any, operands: Any) -> Any:
            # addresses of the arrays' numbers
            kinds = signature.args
            (_, where, _, _, at) = operands
            first, stride, apart, strips, columns = cgutils.unpack_tuple(builder, where)
            data, weights, sums = (context.make_array(kinds[i])(context, builder, operands[i]).data for i in (0, 2, 3))
            entry = builder.gep(data, [first])
            target = builder.gep(sums, [at])
            integer = strips.type

            def group(begin: Any, count: int) -> None:
                here = builder.mul(begin, stride)
                there = builder.mul(begin, integer(4))
                strip = builder.gep(entry, [here])
                rows = builder.gep(target, [there])
                _group(builder, count, strip, stride, apart, columns, weights, rows, adds)

            # strips two at a time; the last one by itself if their number is odd
            pairs = builder.ashr(strips, integer(1))
            with cgutils.for_range(builder, pairs) as loop:
                group(builder.shl(loop.index, integer(1)), 2)
            with builder.if_then(builder.trunc(strips, ir.IntType(1))):
                group(builder.shl(pairs, integer(1)), 1)
            return context.get_dummy_value()

        five = numba.types.UniTuple(numba.types.intp, len(where))
        return numba.types.void(stack, five, y, out, numba.types.unliteral(at)), write

    return intrinsic(product) if is_compiling() else plain


strip_product = _strip_product(False)
"""strip_product(stack, (first, stride, apart, strips, columns), y, out, at): out[at:] = strips of four rows, ``stride``
entries apart from the entry ``first`` of the stack on, their columns so many ``apart``, times y[:columns]."""
strip_product_added = _strip_product(True)
"""``strip_product``, added to the entries of ``out``."""

call_count = _native(numba.int64)
"""Call compiled code that answers a whole number: call_count(address, (values, ...)). Nothing of it is written into the
caller: the same machine code as ever, and no second compilation."""
call_truth = _native(numba.boolean)
"""The same for True or False."""
call_real = _native(numba.float64)
"""The same for a float."""
call_silent = _native(numba.none)
"""The same for code that answers nothing."""

call_code = _foreign(numba.int32)
"""Call a C function that answers an int: call_code(address, (values, ...)); pointers are integers."""
call_pointer = _foreign(numba.intp)
"""Call a C function that answers a pointer."""


def lapack_address(name: str) -> int:
    """Address of a routine in the LAPACK that SciPy contains."""
    return int(get_cython_function_address("scipy.linalg.cython_lapack", name))
