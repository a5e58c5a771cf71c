"""Modes from frequency-response functions: right within what they state, over seeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tyrecal.errors import InputError
from tyrecal.measured import identify as module
from tyrecal.measured.identify import Responses, identify

from ..chance import Chance, generator
from ..studies.identification import OFF, drawn, found

pytestmark = pytest.mark.numbers

HERTZ = np.array([36.5, 38.3, 66.3, 73.3, 87.8, 105.3])
RATIOS = np.array([0.025, 0.031, 0.028, 0.021, 0.022, 0.027])
F = np.arange(25.0, 130.01, 0.625)
OMEGA = {"receptance": 0, "mobility": 1, "accelerance": 2}


def functions(
    seed: int, noise: float = 0.01, form: str = "accelerance", signals: int = 24
) -> tuple[Responses, np.ndarray]:
    """sum over modes of phi_i phi_j (i w)^k / (w_k^2 - w^2 + 2 i zeta w w_k), a triaxial sensor a
    point; and the residues by mode."""
    rng = generator(seed)
    phi = generator(1000 + seed).standard_normal((signals, len(HERTZ)))
    w, wk = 2 * np.pi * F, 2 * np.pi * HERTZ[:, None]
    H = phi @ (1 / (wk**2 - w**2 + 2j * RATIOS[:, None] * w * wk)) * (1j * w) ** OMEGA[form]
    size = noise * np.sqrt(np.mean(np.abs(H) ** 2) / 2)
    H = H + size * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape))
    return Responses(F, H, form, np.repeat(np.arange(signals // 3), 3)), phi


@pytest.mark.slow
def test_frequencies_are_off_by_what_they_state(chance: Chance) -> None:
    """Errors are within two sigma in 19 of 20 modes. Their mean square over sigma is above a
    twentieth, because a useless bound would cover, too.

    False failures: 1e-7.
    """
    standardised = []
    for _ in range(8):
        modes = identify(functions(int(chance.random.integers(1 << 30)))[0], 28.0, 125.0).modes
        assert len(modes) == len(HERTZ)
        hertz = np.array([mode.frequency_Hz for mode in modes])
        sigma = np.array([mode.sigma_Hz for mode in modes])
        assert hertz == pytest.approx(HERTZ, rel=2e-3)
        standardised.append((hertz - HERTZ) / sigma)
    chance.often(np.ravel(np.abs(standardised) < 2), 0.95)
    assert np.mean(np.square(standardised)) > 0.05


@pytest.mark.parametrize("form", list(OMEGA))
def test_shapes_and_damping_come_out_whatever_was_measured(form: str) -> None:
    measured, phi = functions(0, 0.002, form)
    result = identify(measured, 28.0, 125.0)
    assert [mode.frequency_Hz for mode in result.modes] == pytest.approx(HERTZ, rel=1e-3)
    assert [mode.damping for mode in result.modes] == pytest.approx(RATIOS, rel=0.05)
    for k, mode in enumerate(result.modes):
        u = mode.amplitude
        mac = abs(np.vdot(u, phi[:, k])) ** 2 / np.vdot(u, u).real / (phi[:, k] @ phi[:, k])
        assert mac > 0.99
    band = np.isfinite(result.fitted[0])
    rest = np.abs(result.fitted - measured.values)[:, band]
    assert np.mean(rest**2) < 1e-3 * np.mean(np.abs(measured.values[:, band]) ** 2)
    assert not band[F < 28.0].any() and not band[F > 125.0].any()


def test_more_noise_is_more_sigma() -> None:
    little, much = (
        np.median([mode.sigma_Hz for mode in identify(functions(3, noise)[0], 28.0, 125.0).modes])
        for noise in (0.002, 0.02)
    )
    assert much > 2 * little


def test_noise_alone_is_no_mode(chance: Chance) -> None:
    """A mode is found in 1 of 10 files at most.

    False failures: 1e-7.
    """
    modes = []
    for _ in range(10):
        H = chance.random.standard_normal((2, 12, len(F)))
        try:
            noise = Responses(F, H[0] + 1j * H[1], "accelerance", np.arange(12))
            modes.append(len(identify(noise, 28, 125).modes))
        except InputError as error:
            assert "no mode is stable between 28 and 125 Hz" in str(error)
            modes.append(0)
    chance.often(np.array(modes) > 0, 0.0, 0.1)


@pytest.mark.slow
def test_nothing_hangs_on_rounding() -> None:
    """The result is the same for any file and band if every value is off by half a million times
    rounding."""
    for key in range(8):
        measured, low, high = drawn(generator("rounding", key))
        shaken = generator("shaken", key).standard_normal(measured.values.shape)
        other = replace(measured, values=measured.values * (1 + OFF * shaken))
        before, after = found(measured, low, high), found(other, low, high)
        assert len(before) == len(after)
        for (f, _, z), (g, _, other_z) in zip(before, after, strict=True):
            assert g == pytest.approx(f, rel=1e-7) and other_z == pytest.approx(z, rel=1e-4)


def test_uneven_or_few_frequencies_are_refused() -> None:
    measured, _ = functions(0)
    for f in (F**1.01, F[:40]):
        bad = Responses(f, measured.values[:, : len(f)], "accelerance", measured.points)
        with pytest.raises(InputError, match="50 evenly spaced frequencies"):
            identify(bad, 28.0, 125.0)


def test_two_sensors_leave_sigma_unknown() -> None:
    measured, _ = functions(0, 0.002, signals=6)
    modes = identify(measured, 28.0, 125.0).modes
    assert modes and all(np.isnan(mode.sigma_Hz) for mode in modes)


def test_the_lines_at_both_ends_belong_to_the_band(monkeypatch: pytest.MonkeyPatch) -> None:
    """150 lines with both ends give an order of 30, one for every 5; one line fewer 29."""
    orders = set()

    def triangle(H: np.ndarray, order: int) -> np.ndarray:
        orders.add(order)
        return plain(H, order)

    plain = module._triangle
    monkeypatch.setattr(module, "_triangle", triangle)
    for high, order in ((F[160], 30), (F[157], 30), (F[156], 29)):
        orders.clear()
        result = identify(functions(0, 0.002)[0], F[8], high)
        assert orders == {order}
        fitted = np.isfinite(result.fitted[0])
        np.testing.assert_array_equal(fitted, (F[8] <= F) & (high >= F))


def orders(*lines: tuple[float, float, range], count: int = 30) -> list[np.ndarray]:
    """Poles of the orders 1 to ``count``: of each line its frequency and damping, and in which of
    the upper two thirds of the orders it is seen."""
    return [
        np.array([module._pole(np.array(f), np.array(z)) for f, z, seen in lines if j - 10 in seen])
        for j in range(count)
    ]


ALWAYS = range(20)


def hertz_of(poles: list[np.ndarray], low: float = 20.0, high: float = 130.0) -> list[float]:
    return [float(f) for f, _, _ in module._modes(poles, low, high)]


def test_a_mode_is_seen_in_two_fifths_of_the_orders() -> None:
    """A pole counts if its like is in the order below; its first occurrence does not."""
    assert hertz_of(orders((80.0, 0.02, range(9)))) == pytest.approx([80.0])
    assert hertz_of(orders((80.0, 0.02, range(8)))) == []
    assert hertz_of(orders((80.0, 0.02, ALWAYS), (50.0, 0.02, ALWAYS))) == pytest.approx([50, 80])


def test_a_tyres_mode_has_damping_in_the_band_and_decays() -> None:
    for damping, seen in ((0.0019, 0), (0.0021, 1), (0.199, 1), (0.201, 0), (-0.02, 0)):
        assert len(hertz_of(orders((80.0, damping, ALWAYS)))) == seen
    for low, high, seen in ((80.0, 130.0, 1), (20.0, 80.0, 1), (80.1, 130.0, 0), (20.0, 79.9, 0)):
        assert len(hertz_of(orders((80.0, 0.02, ALWAYS)), low - 1e-9, high + 1e-9)) == seen
    mirrored = [each.conj() for each in orders((80.0, 0.02, ALWAYS))]
    assert hertz_of(mirrored) == []


def test_a_pole_comes_again_within_a_hundredth_and_a_fifth_of_its_damping() -> None:
    """Poles that move farther from one order to the next do not count."""
    for ratio, change, seen in ((1.009, 1.0, 1), (1.011, 1.0, 0), (1.0, 1.19, 1), (1.0, 1.27, 0)):
        even, odd = range(0, 20, 2), range(1, 20, 2)
        poles = orders((80.0, 0.02, even), (80.0 * ratio, 0.02 * change, odd))
        assert len(hertz_of(poles)) == seen


def test_poles_within_a_hundredth_are_one_mode_with_their_median_and_spread() -> None:
    """The spread over the orders is 1.48 times the median deviation."""
    drift = [(80.0 * (1 + 1e-4 * j), 0.02, range(j, j + 1)) for j in range(20)]
    ((f, z, spread),) = module._modes(orders(*drift), 20.0, 130.0)
    assert f == pytest.approx(80.0 * (1 + 1e-4 * 10)) and z == pytest.approx(0.02)
    assert spread == pytest.approx(1.4826 * 80.0 * 1e-4 * 5)
    near = orders((80.0, 0.02, ALWAYS), (80.79, 0.02, ALWAYS))
    apart = orders((80.0, 0.02, ALWAYS), (80.9, 0.02, ALWAYS))
    assert len(hertz_of(near)) == 1 and len(hertz_of(apart)) == 2


def test_the_jackknifes_deviation_by_its_formula() -> None:
    """(g - 1) / g times the sum of squares, of the groups that saw the mode within 2 %; of two
    groups it says nothing."""
    again = [np.array([[f, 0.02, 0.0], [50.0, 0.02, 0.0]]) for f in (79.9, 80.1, 80.3, 81.7, 79.7)]
    (deviation, other) = module._jackknife(again, np.array([80.0, 60.0]))
    kept = np.array([79.9, 80.1, 80.3, 79.7])
    assert deviation == pytest.approx(np.sqrt(3 / 4 * np.sum((kept - kept.mean()) ** 2)))
    assert np.isnan(other)
    assert np.isnan(module._jackknife(again[:2], np.array([80.0]))).all()
    assert np.isfinite(module._jackknife(again[:3], np.array([80.0]))).all()
