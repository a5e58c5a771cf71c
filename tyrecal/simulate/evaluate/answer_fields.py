"""Fields of answers: numbers and arrays with their shape and limits, as one schema checks them."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import PlainValidator

Array = np.ndarray
REAL = "fiu"  # NumPy's letters for kinds of number; c: complex
MIN_NUMBER_BYTES = 4  # of a number with decimals: half precision has three digits
MIN_ANSWER_HZ, MAX_ANSWER_HZ = 1e-3, 1e5  # far beyond those of a tyre's vibrations


def shaped(
    kinds: str, *shape: int | None, least: float = -np.inf, most: float = np.inf, nan: bool = False
) -> PlainValidator:
    """A number, or an array or list of them, of ``shape`` (None: any length), finite unless
    ``nan``, above ``least``, at most ``most``."""

    def check(value: Any) -> Any:
        array = np.asarray(value)
        if array.dtype.kind not in kinds or array.ndim != len(shape):
            raise ValueError("is not such a number or array")
        if array.dtype.kind in "fc" and array.dtype.itemsize < MIN_NUMBER_BYTES:
            raise ValueError("has half precision only")
        if not all(n in (None, m) for n, m in zip(shape, array.shape, strict=True)):
            raise ValueError(f"has the shape {array.shape}")
        if not (nan or np.isfinite(array).all()):
            raise ValueError("holds a number that is not finite")
        if least > -np.inf and not (array > least).all():
            raise ValueError(f"must be above {least:g}")
        if most < np.inf and not (array <= most).all():
            raise ValueError(f"must be at most {most:g}")
        return value

    return PlainValidator(check)


Finite = Annotated[float, shaped(REAL)]
PositiveFinite = Annotated[float, shaped(REAL, least=0.0)]
Hertz = Annotated[float, shaped(REAL, least=MIN_ANSWER_HZ, most=MAX_ANSWER_HZ)]
HertzPair = Annotated[Array, shaped(REAL, 2, least=MIN_ANSWER_HZ, most=MAX_ANSWER_HZ)]
HertzArray = Annotated[Array, shaped(REAL, None, least=MIN_ANSWER_HZ, most=MAX_ANSWER_HZ)]
# components r, theta, z: at nodes (k, 3); by ring (ring, node, 3); of m modes (m, ring, node, 3)
Vectors = Annotated[Array, shaped(REAL, None, 3)]
RealArray = Annotated[Array, shaped(REAL, None)]
WholeArray = Annotated[Array, shaped("iu", None)]
Field3D = Annotated[Array, shaped(REAL, None, None, 3)]
Shapes3D = Annotated[Array, shaped(REAL, None, None, None, 3)]
