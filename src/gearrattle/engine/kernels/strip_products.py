"""Products of rows in strips with the vectors of the march.

Rows lie in strips of four, (strips, columns, 4), so that a product keeps four sums in registers. A matrix
in a stack is addressed by an index: in a compiled loop, a view of an array would cost more time than the product.
"""

from __future__ import annotations

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels._llvm import strip_product, strip_product_added


@inlined
def multiply(stack, index, strips, columns, y, out, at):
    """out[at:] = rows @ y[:columns], the first strips of stack[index]."""
    stride = 4 * stack.shape[2]
    strip_product(stack, (index * stack.shape[1] * stride, stride, 4, strips, columns), y, out, at)


@inlined
def multiply_add(stack, index, strips, columns, y, out):
    """out += rows @ y[:columns], the first strips of stack[index]."""
    stride = 4 * stack.shape[2]
    strip_product_added(stack, (index * stack.shape[1] * stride, stride, 4, strips, columns), y, out, 0)


@kernel
def copy(source, count, out):
    """Copy the first ``count`` entries, in a loop: a slice assignment takes seconds more to compile."""
    for i in range(count):
        out[i] = source[i]


@inlined
def add(strips, out, at, y):
    """y += out[at:], in strips of four."""
    for c in range(strips):
        i = 4 * c
        j = at + i
        s0 = y[i] + out[j]
        s1 = y[i + 1] + out[j + 1]
        s2 = y[i + 2] + out[j + 2]
        s3 = y[i + 3] + out[j + 3]
        y[i] = s0
        y[i + 1] = s1
        y[i + 2] = s2
        y[i + 3] = s3


@inlined
def subtract(strips, out, at, y):
    """y -= out[at:], in strips of four."""
    for c in range(strips):
        i = 4 * c
        j = at + i
        s0 = y[i] - out[j]
        s1 = y[i + 1] - out[j + 1]
        s2 = y[i + 2] - out[j + 2]
        s3 = y[i + 3] - out[j + 3]
        y[i] = s0
        y[i + 1] = s1
        y[i + 2] = s2
        y[i + 3] = s3


@kernel
def multiply_row(stack, index, rows, r, out):
    """out = all rows of stack[index] @ rows[r]."""
    for c in range(stack.shape[1]):
        a0 = 0.0
        a1 = 0.0
        a2 = 0.0
        a3 = 0.0
        for j in range(stack.shape[2]):
            weight = rows[r, j]
            a0 += stack[index, c, j, 0] * weight
            a1 += stack[index, c, j, 1] * weight
            a2 += stack[index, c, j, 2] * weight
            a3 += stack[index, c, j, 3] * weight
        out[4 * c] = a0
        out[4 * c + 1] = a1
        out[4 * c + 2] = a2
        out[4 * c + 3] = a3
