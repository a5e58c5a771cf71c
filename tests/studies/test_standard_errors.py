"""The closed form by which a fit's total exceeds the error by the whole covariance."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.studies.fit.least_squares import fit_response

from ..chance import generator
from .standard_errors import compared


@pytest.mark.numbers
@pytest.mark.parametrize("correlated", [True, False])
def test_the_total_of_a_fit_exceeds_the_error_by_the_whole_covariance(correlated: bool) -> None:
    """The excess is (R - R') Sigma (R - R')^T, which is 0 if scatter alone is uncertain."""
    random = generator("standard errors", int(correlated))
    J, scatter = random.normal(size=(9, 3)), random.uniform(0.5, 2.0, 9)
    root = random.normal(size=(9, 9)) * correlated
    sigma = np.diag(scatter**2) + root @ root.T
    response, _ = fit_response(J / scatter[:, None], 1 / scatter)  # as the fit weighs
    both = compared(J, scatter, sigma, response @ sigma @ response.T)
    assert both.departure < 1e-9
    total, best = np.diag(both.total), np.diag(both.by_sigma)
    if correlated:
        assert (total > best).all() and (np.linalg.eigvalsh(both.added) > -1e-12).all()
    else:
        np.testing.assert_allclose(total, best)
