"""Slopes of a pair's eigenvalues: against differences, and by which tangent."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tyrecal_solvers.bundled.deck.request import Request
from tyrecal_solvers.bundled.deck.steps import Deck
from tyrecal_solvers.bundled.frequency_step import FrequencyStep
from tyrecal_solvers.bundled.job import Job

from .job_pairs import FREQUENCY, PLAIN, TURNING, WHEEL, run, texts


def test_slopes_take_the_static_tangent_whatever_the_vibration_has() -> None:
    """Sensitivities use the factor of Newton's method at the inflated state, without the
    vibration's shift and moduli."""
    work = {}
    for name, data in (("plain", "20\n"), ("shifted", "20, , , -1000.\n")):
        pair = dict(texts(PLAIN))
        pair["modes"] = pair["modes"].replace(FREQUENCY, FREQUENCY.replace("20\n", data))
        job = Job(Deck(pair, "modes", "inflate"), Request())
        job._static(job.steps[0])
        work[name] = FrequencyStep(job.tyre, 2, job.steps[2])
    plain, shifted = work["plain"], work["shifted"]
    right = np.ones(plain.equations.size)
    wanted = plain.factor.solve(right)
    np.testing.assert_array_equal(plain.static_factor.solve(right), wanted)
    np.testing.assert_array_equal(shifted.static_factor.solve(right), wanted)
    assert not np.allclose(shifted.factor.solve(right), wanted, rtol=1e-9, atol=0)


@pytest.mark.parametrize(
    "effects",
    [PLAIN, pytest.param(TURNING, marks=pytest.mark.slow), WHEEL],
    ids=["plain", "turning", "wheel"],
)
def test_slopes_by_density_and_shape_against_differences(
    effects: tuple[tuple[str, float], ...],
) -> None:
    """d lambda/dp of all modes of a pair by the rubber's density and the radius of a node of the
    inner surface, which move masses and, turning, forces: within 1e-5 of the largest."""
    lines = texts(effects)["inflate"].splitlines()
    density = lines.index("*DENSITY") + 1
    node = next(i for i, line in enumerate(lines) if line.startswith("21001,"))
    for line, field, scale in ((density, 0, 1100.0), (node, 1, 0.003)):

        def at(step: float, line: int = line, field: int = field, scale: float = scale) -> Any:
            fields = lines[line].split(",")
            fields[field] = repr(float(fields[field]) + step * scale)
            (result, *waves) = run(
                effects,
                (
                    f"\n{lines[line - 1]}\n{lines[line]}\n",
                    f"\n{lines[line - 1]}\n{','.join(fields)}\n",
                ),
                harmonics=[0, 1, 2],
            )
            return np.concatenate([m.eigenvalues for m in (waves or [result])[0].modes])

        sensitivities = {"p": [("inflate", line + 1, field, scale)]}
        result = run(effects, harmonics=[0, 1, 2], sensitivities=sensitivities)[-1]
        h = 5e-3
        wanted = (8 * (at(h) - at(-h)) - at(2 * h) + at(-2 * h)) / (12 * h)
        got = np.concatenate(result.rates["p"])
        assert abs(got - wanted).max() <= 1e-5 * abs(wanted).max()
