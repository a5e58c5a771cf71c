"""A measured frequency that is far off the model's: a slip of digit, unit, label or pressure.

Called before anything is calibrated, by `fit` and by `diagnose` and `sample`.
"""

from __future__ import annotations

MAX_FREQUENCY_RATIO = 2.0  # between measured and computed; beyond, something else was measured
SLIPS = (10.0, 0.1)  # factors of a decimal point in the wrong place
SLIP_FITS = 1.3  # ratio to the model at which such a slip explains the value


def far_off(what: str, measured_Hz: float, model_Hz: float) -> str:
    """Why ``what`` cannot have been measured at such a frequency, and what was probably meant;
    empty where it can."""
    ratio = measured_Hz / model_Hz
    if 1 / MAX_FREQUENCY_RATIO < ratio < MAX_FREQUENCY_RATIO:
        return ""
    meant = [f"{measured_Hz * f:.6g} Hz" for f in SLIPS if 1 / SLIP_FITS < ratio * f < SLIP_FITS]
    hint = f", or did you mean {meant[0]}" if meant else ""
    return (
        f"{what} was measured at {measured_Hz:.6g} Hz, {ratio:.2g} times the model's"
        f" {model_Hz:.4g} Hz; is it the right unit, mode and pressure{hint}?"
    )
