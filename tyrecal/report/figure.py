"""Canvas, fonts and colours of all pictures, and writing them as PNG, SVG or PDF.

A PNG file keeps the numbers that its figure draws. So a picture in a guide can be compared with a
fresh run without comparing pixels, and a reader can see what a picture was drawn from.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from textwrap import fill
from typing import TypedDict

import numpy as np
from markupsafe import Markup
from matplotlib import colormaps, rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text
from matplotlib.ticker import LogFormatter
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from ..files import atomic_write

DPI = 150
COMPRESSION = 3  # of 9: a third of the time of the usual 6, files 19 % larger
COLOUR_MAP = colormaps["viridis"]
GREY = "0.45"
# by Okabe and Ito: colour-blind readers can distinguish them; without yellow, pale on paper
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")

# pale, so that cords stand out
RUBBER = ("#E3E3E3", "#C9DCEB", "#F5E6C0", "#D3C3B3", "#E2D3E8", "#CFE5CB", "#F2CFC9")
MARKERS = "os^Dv<>P"
# variables of the page's style sheet, which has a light, a dark and a printed shade of each colour
THEMED = {colour.lower(): f"var(--s{k})" for k, colour in enumerate(COLOURS)}
THEMED |= {colour.lower(): f"var(--r{k})" for k, colour in enumerate(RUBBER)}
# variable by highest level, 0 (black) to 255, of a grey
GREYS = {0x28: "ink", 0x60: "soft", 0xB0: "edge", 0xFE: "line", 0xFF: "panel"}

in_house_style = rc_context(
    {
        "font.size": 9,
        "axes.titlesize": 11,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "figure.dpi": DPI,
        "hatch.linewidth": 0.6,
        "font.sans-serif": ["DejaVu Sans", "Verdana"],
        "font.monospace": ["DejaVu Sans Mono"],
        "svg.fonttype": "none",
        "svg.hashsalt": "tyrecal",  # the same figure gives the same ids
        "pdf.fonttype": 42,
        "text.parse_math": False,  # a name may have a $
    }
)


class Picture(Figure):
    """A figure that a notebook shows as it is written to a file."""

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        write_png(self, file)
        return file.getvalue()


def new_figure(
    width: float, height: float, layout: str | None = "constrained", caption: str = ""
) -> Figure:
    """An empty figure, its size in inches; caption: the words below it on a page."""
    figure = Picture((width, height), dpi=DPI, layout=layout, label=caption)  # type: ignore[arg-type]
    FigureCanvasAgg(figure)
    return figure


def headline(figure: Figure, words: str) -> None:
    """Add a title above all panels, at the left edge, in as many lines as the width requires."""
    margin = 0.15 / figure.get_figwidth()
    title = figure.suptitle(words, x=margin, ha="left", fontsize=11)
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    room = (1 - 2 * margin) * figure.bbox.width
    for line in range(len(words), 10, -1):
        title.set_text(fill(words, line))
        if title.get_window_extent(renderer).width <= room:
            return


class PlainLogFormatter(LogFormatter):
    """Numbers of a logarithmic axis as 0.1, 10 and 1e-05, at the ticks that Matplotlib labels: its
    own formatter writes mathematical markup, which pictures do not parse."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if super().__call__(x, pos) else ""


def use_plain_numbers(figure: Figure) -> None:
    """Replace the formatters of logarithmic axes by `PlainLogFormatter`."""
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        major, minor = axis.get_major_formatter(), axis.get_minor_formatter()
        if isinstance(major, LogFormatter):
            axis.set_major_formatter(PlainLogFormatter(labelOnlyBase=major.labelOnlyBase))
        if isinstance(minor, LogFormatter):
            axis.set_minor_formatter(PlainLogFormatter(labelOnlyBase=minor.labelOnlyBase))


@in_house_style
def save(figure: Figure, path: Path) -> None:
    """Write a picture in the format of the suffix of ``path``, one of `files.PICTURE_FORMATS`."""
    kind = path.suffix[1:]
    with atomic_write(path) as partial:
        if kind == "png":
            write_png(figure, partial)
            return
        use_plain_numbers(figure)
        undated = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
        figure.savefig(partial, format=kind, metadata=undated[kind])


@in_house_style
def write_png(figure: Figure, file: Path | io.BytesIO) -> None:
    """Write a PNG of 256 colours: a third of the size, and no difference to see. It keeps the
    numbers that it draws, see `drawn_numbers`."""
    use_plain_numbers(figure)
    canvas = figure.canvas
    assert isinstance(canvas, FigureCanvasAgg)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    small = image.quantize(256, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    kept = PngInfo()
    kept.add_itxt(PNG_KEY, json.dumps(drawn_numbers(figure)), zip=True)
    small.save(file, "PNG", compress_level=COMPRESSION, pnginfo=kept)


@in_house_style
def svg(figure: Figure, words: str, key: str) -> Markup:
    """The figure as an SVG element of a page. The same figure gives the same text.

    words: description for readers who cannot see it; key: prefix of its ids, unique on the page.
    """
    use_plain_numbers(figure)
    file = io.StringIO()
    nothing = dict.fromkeys(("Date", "Creator", "Format", "Type"))
    figure.savefig(file, format="svg", transparent=True, metadata=nothing)
    text = file.getvalue()
    body = re.sub(r">\s+<", "><", text[text.index('<g id="figure_1">') :])
    used = dict.fromkeys(re.findall(r'(?:url\(|href=")#([\w-]+)', body))
    ids = {id: f"{key}-{number}" for number, id in enumerate(used)}
    width, height = 72 * figure.get_size_inches()  # pt; a pixel is 3/4 pt
    head = Markup(
        '<svg viewBox="0 0 {:g} {:g}" role="img" aria-label="{}"'
        ' style="min-width:{:.0f}px;max-width:{:.0f}px">'
    ).format(width, height, words, width, width * 4 / 3)
    return head + Markup(re.sub(r"<[^>]*>", lambda tag: _themed(tag[0], ids), body))


def _themed(tag: str, ids: Mapping[str, str]) -> str:
    """An SVG tag with the ids and colours of the page, its numbers rounded to 0.01 pt."""
    tag = " ".join(tag.replace("xlink:", "").split())
    tag = re.sub(r' id="([^"]+)"', lambda m: f' id="{ids[m[1]]}"' if m[1] in ids else "", tag)
    tag = re.sub(r'(url\(|href=")#([\w-]+)', lambda m: f"{m[1]}#{ids[m[2]]}", tag)
    tag = re.sub(r"#[0-9a-f]{6}\b", lambda m: _shade(m[0]), tag)
    return re.sub(r"-?\d+\.\d{3,}", lambda m: f"{float(m[0]):.2f}", tag)


def _shade(colour: str) -> str:
    """The style sheet's variable for a colour; a colour without one as it is."""
    if colour in THEMED or colour != f"#{3 * colour[1:3]}":
        return THEMED.get(colour, colour)
    level = int(colour[1:3], 16)
    return f"var(--{next(name for highest, name in GREYS.items() if level <= highest)})"


PNG_KEY = "tyrecal: drawn numbers"  # of the PNG's text
DRAWN_DIGITS = 6


class Panel(TypedDict):
    """Words and numbers that one panel of a figure draws."""

    words: list[str]
    numbers: list[list[float]]


def drawn_numbers(figure: Figure) -> list[Panel]:
    """Words and numbers of the figure's own texts and of each of its panels.

    numbers: for every line, area, cloud of points and coloured field the count of its values, their
    least, greatest, mean and root mean square to `DRAWN_DIGITS` significant digits, in units of the
    axes. Ticks are left out: they follow from the rest and from the version of Matplotlib.
    """
    return [{"words": _words(figure.texts), "numbers": []}, *map(_panel, figure.axes)]


def _panel(axes: Axes) -> Panel:
    legend = axes.get_legend()
    texts = [*axes.texts, axes.title, axes.xaxis.label, axes.yaxis.label]
    texts += legend.get_texts() if legend else []
    artists: list[Artist] = [*axes.lines, *axes.patches, *axes.collections, *axes.images]
    numbers = [_moments(values) for artist in artists for values in _values(artist)]
    return {"words": _words(texts), "numbers": numbers}


def _words(texts: Iterable[Text]) -> list[str]:
    return [text.get_text() for text in texts if text.get_text()]


def read_drawn_numbers(path: Path) -> list[Panel]:
    """`drawn_numbers` of a PNG that `figure.save` wrote. Raises ValueError if it has none."""
    with Image.open(path) as image:
        text = image.info.get(PNG_KEY)
    if not text:
        raise ValueError(f"{path}: no numbers are kept in this picture")
    panels: list[Panel] = json.loads(text)
    return panels


def _values(artist: Artist) -> Iterator[np.ndarray]:
    """Coordinates that an artist draws, and the values behind its colours, each as one array (n,)
    or (n, k)."""
    if isinstance(artist, Line2D):
        yield from (np.asarray(each, float) for each in artist.get_data(orig=False))
    elif isinstance(artist, Patch):
        path = artist.get_patch_transform().transform_path(artist.get_path())
        yield from np.asarray(path.vertices, float).T
    elif isinstance(artist, Collection):
        yield from np.asarray(artist.get_offsets(), float).T
        if artist.get_paths():
            yield from np.concatenate([np.asarray(p.vertices) for p in artist.get_paths()]).T
    if isinstance(artist, ScalarMappable) and artist.get_array() is not None:
        yield np.ma.filled(np.ma.asarray(artist.get_array(), float), np.nan)


def _moments(values: np.ndarray) -> list[float]:
    known = values[np.isfinite(values)]
    if not known.size:
        return [0]
    moments = known.min(), known.max(), known.mean(), np.sqrt(np.mean(known**2))
    return [known.size, *(float(f"{each:.{DRAWN_DIGITS}g}") for each in moments)]
