"""Modes from frequency-response functions: right within what they state, over seeds."""

from __future__ import annotations

import numpy as np
import pytest

from tyrecal.measured.identify import Responses, identify
from tyrecal.measured.sensors import BadMeasuredData

HERTZ = np.array([36.5, 38.3, 66.3, 73.3, 87.8, 105.3])
RATIOS = np.array([0.025, 0.031, 0.028, 0.021, 0.022, 0.027])
F = np.arange(25.0, 130.01, 0.625)
OMEGA = {"receptance": 0, "mobility": 1, "accelerance": 2}


def functions(
    seed: int, noise: float = 0.01, form: str = "accelerance", signals: int = 24
) -> tuple[Responses, np.ndarray]:
    """sum over modes of phi_i phi_j (i w)^k / (w_k^2 - w^2 + 2 i zeta w w_k), a triaxial sensor a
    point; and the residues by mode."""
    rng = np.random.default_rng(seed)
    phi = np.random.default_rng(1000 + seed).standard_normal((signals, len(HERTZ)))
    w, wk = 2 * np.pi * F, 2 * np.pi * HERTZ[:, None]
    H = phi @ (1 / (wk**2 - w**2 + 2j * RATIOS[:, None] * w * wk)) * (1j * w) ** OMEGA[form]
    size = noise * np.sqrt(np.mean(np.abs(H) ** 2) / 2)
    H = H + size * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    return Responses(F, H, form, np.repeat(np.arange(signals // 3), 3)), phi


def test_frequencies_are_off_by_what_they_state() -> None:
    standardised = []
    for seed in range(6):
        found = identify(functions(seed)[0], 28.0, 125.0).modes
        assert len(found) == len(HERTZ)
        hertz = np.array([mode.frequency_Hz for mode in found])
        sigma = np.array([mode.sigma_Hz for mode in found])
        assert hertz == pytest.approx(HERTZ, rel=2e-3)
        assert (sigma < 5e-3 * HERTZ).all()  # a bound that says nothing would cover, too
        standardised.append((hertz - HERTZ) / sigma)
    z = np.abs(standardised)
    assert np.mean(z < 2) > 0.9 and np.mean(z < 3) > 0.97
    assert 0.2 < np.sqrt(np.mean(np.square(standardised))) < 1.5


@pytest.mark.parametrize("form", list(OMEGA))
def test_shapes_and_damping_come_out_whatever_was_measured(form: str) -> None:
    measured, phi = functions(0, 0.002, form)
    found = identify(measured, 28.0, 125.0)
    assert [mode.frequency_Hz for mode in found.modes] == pytest.approx(HERTZ, rel=1e-3)
    assert [mode.damping for mode in found.modes] == pytest.approx(RATIOS, rel=0.05)
    for k, mode in enumerate(found.modes):
        u = mode.amplitude
        mac = abs(np.vdot(u, phi[:, k])) ** 2 / np.vdot(u, u).real / (phi[:, k] @ phi[:, k])
        assert mac > 0.99
    band = np.isfinite(found.fitted[0])
    rest = np.abs(found.fitted - measured.values)[:, band]
    assert np.mean(rest**2) < 1e-3 * np.mean(np.abs(measured.values[:, band]) ** 2)
    assert not band[F < 28.0].any() and not band[F > 125.0].any()


def test_more_noise_is_more_sigma() -> None:
    little, much = (
        np.median([mode.sigma_Hz for mode in identify(functions(3, noise)[0], 28.0, 125.0).modes])
        for noise in (0.002, 0.02)
    )
    assert much > 2 * little


def test_noise_alone_is_no_mode() -> None:
    rng = np.random.default_rng(0)
    H = rng.standard_normal((12, len(F))) + 1j * rng.standard_normal((12, len(F)))
    try:
        assert len(identify(Responses(F, H, "accelerance", np.arange(12)), 28, 125).modes) <= 1
    except BadMeasuredData as error:
        assert "no mode is stable between 28 and 125 Hz" in str(error)


def test_uneven_or_few_frequencies_are_refused() -> None:
    measured, _ = functions(0)
    for f in (F**1.01, F[:40]):
        bad = Responses(f, measured.values[:, : len(f)], "accelerance", measured.points)
        with pytest.raises(BadMeasuredData, match="50 evenly spaced frequencies"):
            identify(bad, 28.0, 125.0)


def test_two_sensors_leave_sigma_unknown() -> None:
    measured, _ = functions(0, 0.002, signals=6)
    found = identify(measured, 28.0, 125.0).modes
    assert found and all(np.isnan(mode.sigma_Hz) for mode in found)
