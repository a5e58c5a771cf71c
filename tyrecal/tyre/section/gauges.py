"""Gauges: the thickness between two lines of the section, scaled region by region."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from .section import Section, fill_lines

GaugeFactor = tuple[tuple[str, ...], tuple[str, str], float]  # regions, (line, line), factor


@lru_cache(maxsize=8)
def with_gauges(section: Section, gauges: tuple[GaugeFactor, ...]) -> Section:
    """``section`` with thicknesses multiplied by the factors; no regions named = all of them.

    The innermost line between the surfaces (the carcass) stays where it is: gaps outside it move
    what lies outside them outwards, the gap inside it moves the inner surface. A station between
    two regions takes the geometric mean of their factors. Lines keep the stations they have.
    """
    if not gauges:
        return section
    points = fill_lines(section)
    steps = np.diff(points, axis=0)  # (gap, station, 2)
    for regions, (first, second), factor in gauges:
        low, high = sorted((section.names.index(first), section.names.index(second)))
        steps[low:high] *= _share(section, regions, factor)[None, :, None]
    fixed = points[1]
    moved = np.concatenate([[fixed - steps[0], fixed], fixed + np.cumsum(steps[1:], axis=0)])
    moved[np.isnan(section.points)] = np.nan
    return replace(section, points=moved)


def _share(section: Section, regions: tuple[str, ...], factor: float) -> np.ndarray:
    """The factor at each station."""
    logs = np.zeros((2, section.points.shape[1]))  # of the region before and after a station
    start = 0
    for name, count in section.regions:
        if not regions or name in regions:
            logs[0, start + 1 : start + count + 1] = np.log(factor)
            logs[1, start : start + count] = np.log(factor)
        start += count
    logs[0, 0], logs[1, -1] = logs[1, 0], logs[0, -1]
    share: np.ndarray = np.exp(logs.mean(0))
    return share
