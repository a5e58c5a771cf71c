"""Summary of a folder's results, in sentences."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ...studies.diagnose.evidence import NONE
from ...studies.diagnose.result import DiagnosisResult
from ...studies.diagnose.several import present
from ...studies.diagnose.verdict import no_gap_words
from ...studies.effects import EffectResult, Effects
from ...studies.fit.result import FitResult
from ...studies.modes import ModesResult
from ...studies.result import Result
from ...units import display_unit
from ..table import ended_words, nearness

VERDICT_WORDS = {
    "named": "Named",
    "undecided": "Undecided",
    "outside": "Not explained by the catalogue",
}


def summary(result: Result) -> list[str]:
    """A study in short, in sentences."""
    for kind, words in SHORT.items():
        if isinstance(result, kind):
            return words(result)
    return [*map(sentence, result.summary())]


def fit_words(fit: FitResult) -> list[str]:
    """How the fit went, how near it came, where the variables went."""
    unit = fit.objective_unit if fit.objective_unit == "Hz" else "(deviations in sigmas)"
    # of the paper: cases/paper.md
    equation = "equation (1), " if fit.objective_unit == "Hz" else ""
    moves = ", ".join(
        f"{name} from {v.initial:.4g} to {v.value:.4g}"
        + (f" ({100 * (v.value / v.initial - 1):+.0f} %)" if v.initial else "")
        for name, v in fit.variables.items()
    )
    words = [
        f"{ended_words(fit.content())}{_chi2(fit)}.",
        f"The objective ({equation}{fit.method}) went from {fit.initial_objective_Hz:.2f} to"
        f" {fit.objective_Hz:.2f} {unit} in {fit.evaluations} design points.",
    ]
    if fit.modes:
        words.append(f"{nearness(fit.model_dump()['modes'])}.")
    return [*words, f"{moves}."]


def _chi2(fit: FitResult) -> str:
    """chi2 per degree of freedom, where it is known."""
    if fit.chi2_per_dof is None:
        return ""
    return f" (chi2 per degree of freedom {fit.chi2_per_dof:.3g})"


def modes_words(modes: ModesResult) -> list[str]:
    """How many modes, where, of what tyre."""
    hertz = [mode.frequency_Hz for mode in modes.modes]
    where = f"{modes.pressure_kPa:g} kPa" + (f" under {modes.load_N:g} N" if modes.load_N else "")
    words = [
        f"{len(hertz)} frequencies from {min(hertz):.1f} to {max(hertz):.1f} Hz at {where}; the"
        f" tyre weighs {modes.mass_kg:.2f} kg."
    ]
    if modes.deflection_m is not None:
        words.append(f"The axle moves {1e3 * modes.deflection_m:.1f} mm down.")
    return [*words, *map(sentence, modes.findings.words)]


def diagnosis_words(result: DiagnosisResult) -> list[str]:
    """Verdict, size, how far the error shrinks, what next."""
    gap = result.verdict != "no_gap"
    words = [sentence(verdict_words(result) + (f": {result.words}" if gap else ""))]
    if result.effect:
        words[0] += f" Probability {present(result.probabilities, result.effect.split('+')):.2f}."
    if result.robust:
        least, most = result.robust.range  # probability of the verdict
        words.append(
            "It depends on labels that were exchanged: correct the file first."
            if result.exchanged_labels
            else f"Robust: {least:.2f} to {most:.2f} with other priors and standard deviations."
            if result.robust.robust
            else sentence(f"It depends on {result.robust.hangs_on[0]}")
        )
    if result.effect and result.parameter:
        p = result.parameter
        unit, factor = display_unit(p.unit)
        value, low, high = (f"{factor * x:.3g}" for x in (p.value, p.low, p.high))
        words.append(f"Its size is {value} {unit}".rstrip() + f", 90 % between {low} and {high}.")
    if result.shrinkage and gap:
        s = result.shrinkage  # of the rms error of frequencies
        words.append(
            f"On held-out data the error goes from {s.before_percent:.2f} to"
            f" {s.after_percent:.2f} % with {s.effect}: it shrinks by {100 * s.fraction:.0f} %,"
            f" chance alone reaches {100 * s.placebo_95:.0f} % (95 % quantile)."
        )
    if result.next_measurements:
        words.append(f"Next: {result.next_measurements[0].what}.")
    return words


def verdict_words(result: DiagnosisResult) -> str:
    """The verdict of a diagnosis in a few words."""
    if result.verdict == "no_gap":
        return no_gap_words(result.probabilities[NONE]).capitalize()
    return VERDICT_WORDS[result.verdict]


def effect_words(effect: EffectResult) -> str:
    """Rms change of the frequencies by an effect, before and after calibration."""
    words = f"{effect.title}, {effect.symbol} = {effect.value:g} {effect.unit}".rstrip()
    if effect.before_percent is None:
        return f"{words}: no mode is known with it."
    words += f": {effect.before_percent:.1f} % (rms)"
    if effect.after_percent is not None:
        words += f", {effect.after_percent:.1f} % once the variables are fitted again"
    return f"{words}."


def sentence(words: str) -> str:
    """Make a sentence with a capital and a full stop."""
    return words[:1].upper() + words[1:] + ("" if words.endswith((".", "!", "?")) else ".")


SHORT: dict[type[Result], Callable[[Any], list[str]]] = {
    FitResult: fit_words,
    ModesResult: modes_words,
    Effects: lambda result: [effect_words(each) for each in result.rows],
    DiagnosisResult: diagnosis_words,
}
