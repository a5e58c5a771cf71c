"""How unlike what the makers' effects move is to what the catalogue's do, by the trials' rulers.

Of an effect that moves g, and the catalogue's g_j(e) at the size e that comes closest, in what
calibration leaves of both (P, see `ruler`), two numbers:

    (g - g_j)^T P (g - g_j) / lambda,  lambda = g^T P g;    e over the size that it was made with
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import log
from pathlib import Path

import numpy as np

from tyrecal.measured.tables import read_measurements
from tyrecal.studies.blind.protocol import open_truth, read_protocol
from tyrecal.studies.blind.ruler import read_ruler
from tyrecal.studies.blind.score import means

from .cases import Group
from .score import moved_by

SEEN = 8.0  # lambda from which an effect's shape can be told
Unlike = dict[str, list[tuple[float, float]]]  # by id: share of lambda left, and ratio of sizes


def unlike(folder: Path, sealed: Path) -> Unlike:
    """For every effect of a group that is seen, alone or among others: the share of its shift that
    the catalogue's effect leaves, and the ratio of the sizes. Raises InputError."""
    protocol, ruler, result = read_protocol(folder), read_ruler(folder), Unlike()
    for truth in open_truth(folder, sealed)["trials"]:
        readings = read_measurements(folder / "trials" / f"{truth['id']}.csv")
        _, places, counts = means(readings, ruler)
        d = np.array([log(value) for value in truth["variables"].values()]) - ruler.x0
        P = ruler.projection(d, places, ruler.sigma(places, counts, protocol))
        for id, size in truth["effects"].items():
            if id not in ruler.signatures:
                continue
            shift, _ = moved_by(id, truth, ruler, places)
            sizes, own, _ = ruler.signatures[id].grid(d, places)
            left = np.einsum("qn,nm,qm->q", own - shift, P, own - shift)
            lam = float(shift @ P @ shift)
            if lam >= SEEN:
                best = int(np.argmin(left))
                result.setdefault(id, []).append((float(left[best]) / lam, sizes[best] / size))
    return result


def table_of_unlike(by_group: Iterable[tuple[Group, Unlike]]) -> str:
    """Medians by effect, size and section: per cent of lambda left, ratio of sizes, and of how
    many."""
    cells: dict[str, dict[tuple[str, bool], list[tuple[float, float]]]] = {}
    for group, each in by_group:
        for id, several in each.items():
            place = cells.setdefault(id, {}).setdefault((group.size, group.own), [])
            place.extend(several)
    places = sorted({place for each in cells.values() for place in each})
    heads = [f"{size} {'own' if own else 'foreign'}" for size, own in places]
    lines = [f"| effect | {' | '.join(heads)} |", "|---" * (1 + len(heads)) + "|"]
    for id, each in sorted(cells.items()):
        lines.append(f"| {id} | {' | '.join(_cell(each, place) for place in places)} |")
    return "\n".join(lines)


def _cell(
    each: Mapping[tuple[str, bool], list[tuple[float, float]]], place: tuple[str, bool]
) -> str:
    if place not in each:
        return ""
    left, ratio = np.median(each[place], axis=0)
    return f"{100 * left:.0f} %, {ratio:.2f} ({len(each[place])})"
