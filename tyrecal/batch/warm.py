"""Modules that every worker process needs, imported once, by the process that all of them are
forked from.

Only that process imports this module: `pool.warm_up`.
"""

import gc
from contextlib import suppress
from importlib import import_module
from importlib.metadata import entry_points

from ..simulate.evaluate.pool import leave_interrupts_to_parent

leave_interrupts_to_parent()

from ..simulate.evaluate.solver import GROUP  # noqa: E402
from . import case  # noqa: E402, F401  takes a second: the studies and all that they need

for entry in entry_points(group=GROUP):
    with suppress(Exception):  # a solver that cannot be imported says so where it is asked for
        entry.load()
import_module("tyrecal_solvers.bundled.job")  # imported when it is used

gc.freeze()  # so that a worker's collector leaves these pages shared
