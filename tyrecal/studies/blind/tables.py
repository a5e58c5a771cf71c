"""Scored trials as tables: rates with exact bounds, calibration, held-out errors, every miss."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...files import Json
from .score import Scored
from .statistics import calibration_error, calibration_quantile, clopper_pearson

# ranges of `Scored.band`, and of lambda
DIFFICULTY_BANDS = ((0.0, 4.0), (4.0, 10.0), (10.0, 25.0), (25.0, float("inf")))
DETECTED = 10.0  # band from which an effect counts as detectable


def summary(trials: Sequence[Scored]) -> Json:
    """All figures, as plain data; a rate is {"right", "count", "share", "low", "high"}."""
    effects = [t for t in trials if t.kind == "effect"]
    none = [t for t in trials if t.kind == "none"]
    outside = [t for t in trials if t.kind == "outside"]
    named = [t for t in trials if t.verdict == "named"]
    detected = [t for t in effects if t.band >= DETECTED]
    stated = np.array([t.probabilities[t.ranked[0]] for t in trials])
    right = np.array([t.ranked[0] == t.truth for t in trials], float)
    # held-out shrinkage where there is no effect, by chance
    placebo = float(np.quantile([t.shrinkage for t in none], 0.95)) if none else None
    parameters = [t.parameter_held for t in trials]
    proven = [t for t in detected if t.verdict == "named"]
    shrinks = [t.shrinkage for t in proven]
    return {
        "trials": {"effect": len(effects), "none": len(none), "outside": len(outside)},
        "swapped": sum(t.swapped for t in trials),
        "by_band": [
            {"low": low, "high": high if high < 1e9 else None, **_band(effects, low, high)}
            for low, high in DIFFICULTY_BANDS
        ],
        "false_alarms": rate([t.verdict == "named" for t in none]),
        "named_right": rate([t.named in t.group for t in named]),
        "outside_recognised": rate([t.verdict == "outside" for t in outside]),
        "outside_named": rate([t.verdict == "named" for t in outside]),
        "calibration_error": calibration_error(stated, right),
        "calibration_error_95": calibration_quantile(stated),
        "set_holds_truth": rate([t.in_set for t in trials]),
        "interval_holds_parameter": rate([held for held in parameters if held is not None]),
        "held_out": {
            "count": len(proven),
            "median_shrinkage": float(np.median(shrinks)) if proven else None,
            "placebo_95": placebo,
            "beyond_placebo": rate([shrink > (placebo or 0.0) for shrink in shrinks]),
        },
        "misses": [
            t.plain()
            for t in trials
            if not t.right or (t.verdict == "named" and t.named not in t.group)
        ],
    }


def rate(hits: Sequence[bool]) -> Json:
    """A share with its exact 95 % bounds."""
    right, count = sum(hits), len(hits)
    low, high = clopper_pearson(right, count)
    share = right / count if count else None
    return {"right": right, "count": count, "share": share, "low": low, "high": high}


def page(figures: Json, maker: str) -> str:
    """The figures as a page of Markdown."""
    return "\n".join(_lines(figures, maker)) + "\n"


def _band(effects: Sequence[Scored], low: float, high: float) -> Json:
    """Rates of right first and second answers among the effects of one band of difficulty."""
    here = [t for t in effects if low <= t.band < high]
    return {
        "top_1_group": rate([t.right for t in here]),
        "top_1": rate([t.ranked[0] == t.truth for t in here]),
        "top_2_group": rate([bool(set(t.ranked[:2]) & set(t.group)) for t in here]),
    }


def _lines(f: Json, maker: str) -> Iterator[str]:
    kinds = ", ".join(f"{count} {kind}" for kind, count in f["trials"].items())
    yield f"Maker: {maker}.\nTrials: {kinds}; labels swapped in {f['swapped']}.\n"
    yield "| min(lambda, delta^2) | trials | top 1, group | top 1 | top 2, group |"
    yield "|---|---|---|---|---|"
    for band in f["by_band"]:
        span = f"{band['low']:g} to {band['high']:g}" if band["high"] else f"{band['low']:g} on"
        cells = [_rate(band[key]) for key in ("top_1_group", "top_1", "top_2_group")]
        yield f"| {span} | {band['top_1']['count']} | {' | '.join(cells)} |"
    yield "\n| quantity | measured |\n|---|---|"
    for key, each in f.items():
        if isinstance(each, dict) and "share" in each:
            yield f"| {key.replace('_', ' ')} | {_rate(each)} |"
    yield (
        f"| calibration error (95 % quantile of a calibrated simulation) |"
        f" {f['calibration_error']:.3f} ({f['calibration_error_95']:.3f}) |"
    )
    out = f["held_out"]
    yield (
        f"| held-out shrinkage, detectable and named: median (placebo's 95 % quantile) |"
        f" {_number(out['median_shrinkage'])} ({_number(out['placebo_95'])}), {out['count']}"
        " trials |"
    )
    yield "\n| missed | truth | size | band | verdict | likeliest |\n|---|---|---|---|---|---|"
    for t in f["misses"]:
        law = f"{t['truth']}: {t['law']}" if t["kind"] == "outside" else t["truth"]
        law += " (swapped)" if t["swapped"] else ""
        yield (
            f"| {t['id']} | {law} | {t['size']:.3g} | {t['band']:.1f} | {t['verdict']} |"
            f" {', '.join(t['top'])} |"
        )


def _rate(each: Json) -> str:
    """A rate in words: right of count, share and its 95 % interval."""
    if not each["count"]:
        return "none"
    return (
        f"{each['right']} of {each['count']}, {each['share']:.0%}"
        f" ({each['low']:.0%} to {each['high']:.0%})"
    )


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.2f}"
