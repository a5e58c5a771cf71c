"""The page of scored blind trials: rates with exact bounds, calibration, errors, every miss."""

from __future__ import annotations

from collections.abc import Iterator

from ..files import Json


def page(figures: Json, maker: str) -> str:
    """The figures as a page of Markdown."""
    return "\n".join(_lines(figures, maker)) + "\n"


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
