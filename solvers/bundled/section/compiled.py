"""SciPy's compiled routines without the packages round them, whose imports take as long as two
evaluations: `scipy.linalg` and `scipy.sparse` bring f2py, unittest and half of NumPy along.

SciPy and NumPy each have a copy of OpenBLAS, which takes a buffer of 32 MB in its first call and
keeps it. Without memory for it OpenBLAS tries for ever, so the buffers are taken on import.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader, FileFinder
from importlib.util import module_from_spec
from pathlib import Path
from types import ModuleType

import numpy as np
import scipy

BUFFER_BYTES = 1 << 26  # twice a buffer of OpenBLAS


def compiled(name: str) -> ModuleType:
    """An extension module of SciPy by its dotted name; through its package where it has no file.

    It is the same one for who imports the package before or later."""
    folder = Path(scipy.__file__).parent.joinpath(*name.split(".")[1:-1])
    spec = FileFinder(str(folder), (ExtensionFileLoader, EXTENSION_SUFFIXES)).find_spec(name)
    if name in sys.modules or spec is None or spec.loader is None:
        return import_module(name)
    module = sys.modules[name] = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def take_buffers() -> None:
    """Let both copies of OpenBLAS take their buffers. Raises MemoryError if there is no memory."""
    for first_call in (
        lambda: LAPACK.dpbtrs(np.ones((1, 1)), np.ones(1)),
        lambda: np.linalg.solve(np.ones((1, 1)), np.ones(1)),
    ):
        np.empty(BUFFER_BYTES, np.uint8)  # raises; its pages are never touched
        first_call()


LAPACK = compiled("scipy.linalg._flapack")
take_buffers()
