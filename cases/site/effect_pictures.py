"""Pictures of the effects, drawn as text from the table of the record: no tyre is computed, and
their colours are those of the page, light, dark or printed."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

RECORD = Path(__file__).parents[2] / "tests/benchmarks/records/EFFECTS.md"
PRESSURE_kPa = "240"
WIDTH, HEIGHT, BAR, TEXT = 640, 190, 26, 11  # of the picture, half of it, a bar, letters


@cache
def changes() -> dict[str, dict[str, tuple[float, ...]]]:
    """Change of each mode's frequency in per cent by effect, before and after a new fit."""
    table = RECORD.read_text(encoding="utf-8").split("| effect | size | kPa |")[1]
    head, *lines = table.split("\n")
    modes = [mode.strip().replace("axial", "lateral") for mode in head.strip(" |").split("|")]
    known = {}
    for line in lines:
        match = re.match(rf"\| `(\w+)` \| [^|]+ \| {PRESSURE_kPa} \| (.*) \|", line)
        if match:
            pairs = [tuple(map(float, cell.split(" / "))) for cell in match[2].split(" | ")]
            known[match[1]] = dict(zip(modes, pairs, strict=True))
    return known


def picture(id: str) -> str:
    """Bars over the modes as SVG, the first of each two before and the second after a new fit."""
    by_mode = changes()[id]
    largest = max(abs(value) for pair in by_mode.values() for value in pair) or 1.0
    step, scale, zero = WIDTH / len(by_mode), (HEIGHT / 2 - 2 * TEXT) / largest, HEIGHT / 2
    shapes = [f'<line x2="{WIDTH}" y1="{zero}" y2="{zero}"/>']
    for number, (mode, pair) in enumerate(by_mode.items()):
        middle = (number + 0.5) * step
        for k, value in enumerate(pair):
            left, height = middle + (k - 1) * BAR, scale * abs(value)
            top = zero - height if value > 0 else zero
            end = top - 3 if value > 0 else top + height + TEXT
            place = f'x="{left:.1f}" y="{top:.1f}" width="{BAR - 2}" height="{height:.1f}"'
            shapes.append(f'<rect class="bar-{k}" {place}/>')
            shapes.append(_text(left + BAR / 2 - 1, end, f"{value:+.1f}"))
        for k, word in enumerate(mode.split()):
            shapes.append(_text(middle, HEIGHT + (k + 1) * (TEXT + 2), word))
    words = f"Change of frequency by {id} at {PRESSURE_kPa} kPa, %; second bars: after a new fit"
    size = f'viewBox="0 0 {WIDTH} {HEIGHT + 40}"'
    bars = "".join(shapes)
    return f'<div class="effect"><svg role="img" aria-label="{words}" {size}>{bars}</svg></div>'


def _text(x: float, y: float, words: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}">{words}</text>'
