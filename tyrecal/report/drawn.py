"""The numbers that a figure draws, kept in its PNG file.

`figure.save` writes them, so that a picture in a guide can be compared with a fresh run without
comparing pixels, and a reader of a picture can see what it was drawn from.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypedDict

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import Collection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text
from PIL import Image

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
