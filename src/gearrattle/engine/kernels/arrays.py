"""Types of the arrays that kernels take: what their entries are, and how many axes they have.

numba works out types by itself; these are for readers and type checkers. A comment beside says how long each axis is.
"""

import numpy as np

Vector = np.ndarray[tuple[int], np.dtype[np.float64]]
Matrix = np.ndarray[tuple[int, int], np.dtype[np.float64]]
Array3 = np.ndarray[tuple[int, int, int], np.dtype[np.float64]]
Array4 = np.ndarray[tuple[int, int, int, int], np.dtype[np.float64]]

IntVector = np.ndarray[tuple[int], np.dtype[np.int64]]
IntMatrix = np.ndarray[tuple[int, int], np.dtype[np.int64]]
IntArray3 = np.ndarray[tuple[int, int, int], np.dtype[np.int64]]
Int32Vector = np.ndarray[tuple[int], np.dtype[np.int32]]
UInt64Vector = np.ndarray[tuple[int], np.dtype[np.uint64]]

ComplexVector = np.ndarray[tuple[int], np.dtype[np.complex128]]
ComplexMatrix = np.ndarray[tuple[int, int], np.dtype[np.complex128]]

BoolVector = np.ndarray[tuple[int], np.dtype[np.bool_]]
BoolMatrix = np.ndarray[tuple[int, int], np.dtype[np.bool_]]
ByteVector = np.ndarray[tuple[int], np.dtype[np.uint8]]
