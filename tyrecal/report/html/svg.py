"""Plots as inline SVG: small panels, legible on a telephone, coloured by the page's style sheet."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from ..pressure import apart

Point = tuple[float, float]
WIDTH, HEIGHT = 340, 270  # of a panel, in pixels of a telephone
LEFT, RIGHT, TOP, BOTTOM = 46, 56, 26, 40
MINUS = "\N{MINUS SIGN}"
LINE = 14  # height of a line of text
MARKS = (  # one for each colour: nothing is told by colour alone
    "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0",
    "M-3.5-3.5h7v7h-7z",
    "M0-4.5L4.2 3.2h-8.4z",
    "M0-4.8L4.8 0L0 4.8L-4.8 0z",
    "M0 4.5L4.2-3.2h-8.4z",
    "M-4-1.3h2.7V-4h2.6v2.7H4v2.6H1.3V4h-2.6V1.3H-4z",
)


@dataclass(frozen=True)
class Axis:
    """A range with a label; ``log``: logarithmic, ``whole``: ticks at whole numbers only."""

    low: float
    high: float
    label: str
    log: bool = False
    whole: bool = False

    def at(self, value: float) -> float:
        """0 at the lower end, 1 at the upper."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def ticks(self) -> list[float]:
        """Five or so round numbers."""
        if self.log:
            for steps in ((1,), (1, 3), (1, 2, 5), (1, 1.5, 2, 3, 5, 7)):
                found = [
                    s * 10.0**k
                    for k in range(math.floor(math.log10(self.low)), 20)
                    for s in steps
                    if self.low * 0.999 <= s * 10.0**k <= self.high * 1.001
                ]
                if len(found) > 2:
                    return found[:: -(-len(found) // 8)]
            return [self.low, self.high]
        step = 10.0 ** math.floor(math.log10((self.high - self.low) / 4))
        step *= next(s for s in (1, 2, 5, 10) if (self.high - self.low) / (s * step) <= 6)
        if self.whole:
            step = max(1.0, round(step))
        first = math.ceil(self.low / step - 1e-9)
        return [k * step for k in range(first, math.floor(self.high / step + 1e-9) + 1)]


def around(values: Iterable[float], label: str, log: bool = False, zero: bool = False) -> Axis:
    """An axis that shows the values with some air; ``zero``: from 0 on."""
    shown = [value for value in values if math.isfinite(value) and (value > 0 or not log)]
    low, high = (min(shown), max(shown)) if shown else (1.0, 10.0)
    if log:
        return Axis(low / 1.15, high * 1.15, label, True)
    air = 0.06 * (high - low) or 0.05 * abs(high) or 1.0
    return Axis(0.0 if zero else low - air, high + air, label)


class Panel:
    """One plot: lines and marks in classes s0, s1 ... of the style sheet."""

    def __init__(self, title: str, x: Axis, y: Axis, height: int = HEIGHT, left: int = LEFT):
        self.title, self.x, self.y, self.height, self.left = title, x, y, height, left
        self.right = WIDTH - (RIGHT if left == LEFT else LINE)
        self.parts: list[Markup] = []

    def place(self, point: Point) -> Point:
        """Pixels."""
        across, up = self.x.at(point[0]), self.y.at(point[1])
        return (
            round(self.left + across * (self.right - self.left), 1),
            round(self.height - BOTTOM - up * (self.height - TOP - BOTTOM), 1),
        )

    def line(self, points: Sequence[Point], style: str, step: bool = False) -> None:
        """A polyline; ``step``: a staircase. Points that are not finite are gaps."""
        there = [self.place(p) for p in points if math.isfinite(p[1])]
        if step:
            there = [
                p
                for a, b in zip(there, [*there[1:], there[-1]], strict=True)
                for p in (a, (b[0], a[1]))
            ]
        text = " ".join(f"{x:g},{y:g}" for x, y in there)
        self.parts.append(Markup('<polyline class="{}" points="{}"/>').format(style, text))

    def mark(self, point: Point, kind: int, style: str, words: str) -> None:
        """A mark, and what it says under the mouse."""
        x, y = self.place(point)
        self.parts.append(
            Markup(
                '<path class="mark {}" d="{}" transform="translate({:g} {:g})">'
                "<title>{}</title></path>"
            ).format(style, MARKS[kind % len(MARKS)], x, y, words)
        )

    def cross(self, point: Point, words: str) -> None:
        """A measured value."""
        x, y = self.place(point)
        self.parts.append(
            Markup(
                '<path class="target" d="M-5-5L5 5M-5 5L5-5" transform="translate({:g} {:g})">'
                "<title>{}</title></path>"
            ).format(x, y, words)
        )

    def level(self, value: float, words: str = "") -> None:
        """A line across at a value of y."""
        (x0, y), (x1, _) = self.place((self.x.low, value)), self.place((self.x.high, value))
        self.parts.append(Markup('<path class="level" d="M{:g} {:g}H{:g}"/>').format(x0, y, x1))
        if words:
            self.text(x0 + 4, y - 4, words)

    def upright(self, value: float) -> None:
        """A line up at a value of x."""
        (x, y0), (_, y1) = self.place((value, self.y.low)), self.place((value, self.y.high))
        self.parts.append(Markup('<path class="level" d="M{:g} {:g}V{:g}"/>').format(x, y0, y1))

    def span(self, low: Point, high: Point, style: str = "") -> None:
        """A thin line from point to point."""
        (x0, y0), (x1, y1) = self.place(low), self.place(high)
        d = f"M{x0:g} {y0:g}L{x1:g} {y1:g}"
        self.parts.append(Markup('<path class="span {}" d="{}"/>').format(style, d))

    def text(self, x: float, y: float, words: str, anchor: str = "start") -> None:
        """Words at a pixel."""
        text = Markup('<text x="{:g}" y="{:g}" text-anchor="{}">{}</text>')
        self.parts.append(text.format(x, y, anchor, words))

    def names(self, ends: Sequence[tuple[float, str]]) -> None:
        """Words right of the lines' ends (values of y), moved apart where they would touch."""
        ends = sorted(ends)
        room = self.height - TOP - BOTTOM
        places = apart([self.y.at(y) for y, _ in ends], (LINE - 2) / room)
        for (_, words), up in zip(ends, places, strict=True):
            self.text(self.right + 6, self.height - BOTTOM - up * room + 4, words)

    def rows(self, words: Sequence[str]) -> None:
        """Names of rows 0, 1, ... from above, in the place of an axis of numbers."""
        for row, each in enumerate(words):
            _, y = self.place((self.x.low, -row))
            self.text(self.left - 6, y + 4, each, "end")

    def svg(self, numbers: bool = True) -> Markup:
        """The panel; ``numbers``: on the upright axis."""
        foot, right = self.height - BOTTOM, self.right
        axes = [Markup('<text class="title" x="2" y="14">{}</text>').format(self.title)]
        for value in self.x.ticks():
            x, _ = self.place((value, self.y.low))
            axes.append(Markup('<path class="grid" d="M{:g} {:g}V{}"/>').format(x, foot, TOP))
            axes.append(_number(x, foot + 14, value, "middle"))
        for value in self.y.ticks() if numbers else ():
            _, y = self.place((self.x.low, value))
            axes.append(Markup('<path class="grid" d="M{} {:g}H{}"/>').format(self.left, y, right))
            axes.append(_number(self.left - 5, y + 4, value, "end"))
        middle = (self.left + right) / 2
        axes.append(
            Markup('<text x="{:g}" y="{}" text-anchor="middle">{}</text>').format(
                middle, self.height - 8, self.x.label
            )
        )
        if numbers:
            up = Markup('<text class="up" transform="translate(11 {:g}) rotate(-90)">{}</text>')
            axes.append(up.format((TOP + foot) / 2, self.y.label))
        words = f"{self.title}: {self.y.label} over {self.x.label}" if numbers else self.title
        return drawing(WIDTH, self.height, words, [*axes, *self.parts])


def drawing(width: float, height: float, words: str, parts: Iterable[Markup]) -> Markup:
    """An SVG of its own, told in ``words`` to who does not see it."""
    head = Markup('<svg viewBox="0 0 {:g} {:g}" role="img" aria-label="{}">').format(
        width, height, words
    )
    return Markup("").join([head, *parts, Markup("</svg>")])


def _number(x: float, y: float, value: float, anchor: str) -> Markup:
    text = f"{value:.6g}".replace("-", MINUS)
    return Markup('<text x="{:g}" y="{:g}" text-anchor="{}">{}</text>').format(x, y, anchor, text)
