"""Fixtures for the whole folder: one small tyre, not inflated and inflated, its vibrations, and one
with a model of half of its section."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from threadpoolctl import threadpool_limits
from tyrecal_solvers.bundled.modes.harmonics import Vibration
from tyrecal_solvers.bundled.section.model import Model
from tyrecal_solvers.bundled.section.parts.pressure import Pressure

from ..chance import generator
from . import support
from .support import Halves, inflated_halves

Array = np.ndarray


@dataclass(frozen=True)
class Inflated:
    """The small tyre under 240 kPa: held (n, 3), displacements U (n, 3)."""

    tyre: support.Tyre
    model: Model
    held: Array
    loads: list[Pressure]
    U: Array


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> Iterator[None]:
    """Matrices this small only lose by threads."""
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="session")
def inflated() -> Inflated:
    tyre = support.tyre()
    model = support.model_of(tyre.deck)
    held, loads = support.held(model, tyre.rim), support.cavity(model, 240e3)
    return Inflated(tyre, model, held, loads, support.inflate(model, held, loads))


@pytest.fixture(scope="module")
def vibration(inflated: Inflated) -> Vibration:
    number = support.numbering(inflated.model, inflated.held)
    return Vibration(inflated.model, inflated.U, inflated.loads, number, 0.0)


@pytest.fixture(scope="module")
def halves() -> Halves:
    return inflated_halves()


@pytest.fixture
def random() -> np.random.Generator:
    return generator(7)
