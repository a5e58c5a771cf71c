"""The cases that study 3's tyres are diagnosed with: as `tyrecal init SIZE` writes them (foreign),
or with the maker's own section as its drawing has it (own);
and kinds of trials, with what their numbers tell of how many effects a tyre has."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

import numpy as np

from tyrecal.errors import InputError
from tyrecal.studies.diagnose.evidence import NONE, OUTSIDE
from tyrecal.studies.diagnose.several import MAX_EFFECTS, priors
from tyrecal.studies.fit.targets import USUAL_LABELS
from tyrecal.tyre.case import LoadedCase
from tyrecal.tyre.case.new_case import from_file, from_size
from tyrecal.tyre.effects.edit import changed, with_part
from tyrecal.tyre.load import load_case
from tyrecal.tyre.section.from_size import BELOW, BELTED, GaugeTable
from tyrecal.tyre.section.size import parse_size

from .section import TREAD, VOID, Mould, at, carcass, mould

EFFECTS_OF = {"none": 0, "one": 1, "two": 2, "three": 3, "outside": 0}
EFFECTS_OF |= {"one_strong": 1, "two_strong": 2, "three_strong": 3, "outside_strong": 0}
EFFECTS_OF |= {"one_faint": 1, "one_weak": 1}


def further(counts: Mapping[str, int]) -> float:
    """Tyres with two effects over those with one, and with three over those with two, of which the
    mean number of effects is that of ``counts`` (`Protocol.counts`): what the rules tell whoever
    answers, f in (1 + 2 f + 3 f^2) / (1 + f + f^2) = mean. 0 in the studies before, whose tyres
    have one effect at most. Raises InputError where all have three, of which no f tells."""
    numbers = {**EFFECTS_OF, "again": 1, "effect": 1}
    have = [numbers[kind] for kind, count in counts.items() for _ in range(count) if numbers[kind]]
    if not have:
        return 0.0
    if min(have) == MAX_EFFECTS:
        raise InputError("add a tyre of one or two effects: that all have three no prior can tell")
    mean = sum(have) / len(have)
    a, b, c = 3 - mean, 2 - mean, 1 - mean
    return (-b + sqrt(b * b - 4 * a * c)) / (2 * a)


def weighed_again(p: Mapping[str, float], before: float, after: float) -> dict[str, float]:
    """Probabilities by key as they were answered with one prior of a further effect, by another:
    Bayes' rule about `several.priors`, of which the number of effects in the catalogue cancels."""
    old, new = (priors(MAX_EFFECTS, further) for further in (before, after))
    times = {k: new.get(k, 0.0) / old[k] for k in old}
    sets = {key: 1.0 if key in (NONE, OUTSIDE) else times[key.count("+") + 1] for key in p}
    whole = sum(p[key] * sets[key] for key in p)
    return {key: p[key] * sets[key] / whole for key in p}


LABELS = list(USUAL_LABELS)
LEARNED_FROM = "205_60r15_foreign"  # answered and opened while the answerer could still change

CAR, TRUCK = ((160.0, 240.0, 320.0), 200.0), ((500.0, 720.0, 850.0), 620.0)  # kPa given, held out
SIZES = {"175/70R13": CAR, "205/60R15": CAR, "P235/75R17": CAR, "275/40R20": CAR, "11R22.5": TRUCK}


@dataclass(frozen=True)
class Group:
    """A size, and whose section it is diagnosed with; further trials of the same are another
    series."""

    size: str
    own: bool
    series: int = 1

    @property
    def name(self) -> str:
        """Name of the group's folder."""
        size = self.size.lower().replace("/", "_").replace(".", "_")
        series = f"_{self.series}" if self.series > 1 else ""
        return f"{size}_{'own' if self.own else 'foreign'}{series}"

    @property
    def given_kPa(self) -> tuple[float, ...]:
        return SIZES[self.size][0]

    @property
    def held_out_kPa(self) -> float:
        return SIZES[self.size][1]

    @property
    def off(self) -> tuple[float, float]:
        """How far tyres are from the mould, one standard deviation: m, and a share of gauges. The
        own section is from a drawing; makers of one size differ by more, besides their rules."""
        return (0.8e-3, 0.04) if self.own else (1.5e-3, 0.06)


GROUPS = [
    Group(size, own, series) for series in range(1, 18) for size in SIZES for own in (True, False)
]


SURFACE_HELD = 4  # the series from which on cases hold the bead's surface, as the makers do
# from which on a truck's by a size code does not: its turned-up cords, longer than the maker's,
# would bear a compression at which [0,0] axial falls by 9 % in a finer mesh (`wrinkles`)
TRUCKS_AS_WRITTEN = 8
KNOWN = {"C10": 5, "density": 1.0}  # percent, of one's own compounds


def written(group: Group, folder: Path) -> LoadedCase:
    """The case of a group, in ``folder``; whoever has a section's drawing knows its compounds."""
    size = parse_size(group.size)
    if group.own:
        stations = folder / f"{group.name}.csv"
        stations.write_text(stations_of(mould(group.size)).csv(), encoding="utf-8", newline="")
        draft = from_file(stations, size, None, None)
    else:
        draft = from_size(size, {}, None, group.name)
        (folder / draft.file).write_bytes(draft.content)
    path = folder / f"{group.name}.yaml"
    text = draft.text
    as_written = group.series >= TRUCKS_AS_WRITTEN and size.truck and not group.own
    if group.series >= SURFACE_HELD and not as_written:
        text = text.replace("holds: whole_bead", "holds: bead_surface")
        assert "holds: bead_surface" in text
    if group.own:
        for what, percent in KNOWN.items():
            text, count = re.subn(rf"(_{what}: {{[^}}]*percent: )[0-9.]+", rf"\g<1>{percent}", text)
            assert count
    path.write_text(text, encoding="utf-8")
    return load_case(path, allow_unusual=True)


def with_exact_section(case: LoadedCase) -> LoadedCase:
    """The case without doubt about its section, which the maker's tyres do not have: they differ by
    laws of their own."""
    return changed(case, section=with_part(case.case.section, known_from="exact"))


def stations_of(m: Mould) -> GaugeTable:
    """The mould's lines as a drawing has them that a user digitised: a smooth tread of the
    pattern's mean thickness, the turned-up ply from the widest point on, of a truck from where it
    ends, at the first third of the filler's stations, where an element begins."""
    marks = carcass(m)[2]
    truck = parse_size(m.size).truck
    edges = sorted(set(m.belts))
    ends = [*edges, marks["widest"], marks["filler"], marks["rim"], marks["end"]]
    names = ["crown", "belt_edges", "shoulder"] if len(edges) > 2 else ["crown", "shoulder"]
    counts = [*((name, BELTED[name]) for name in names), *BELOW.items()]
    if truck:
        ends.insert(-2, marks["turn_up"])
        counts[-2:-1] = [("filler", 4), ("filler", 8)]
    arc, labels = [0.0], ["crown"]
    for (name, count), a, b in zip(counts, [0.0, *ends], ends, strict=False):
        arc += list(a + (b - a) * np.arange(1, count + 1) / count)
        labels += [name] * count
    labels[-BELOW["bead"] - 1] = "bead"
    s = np.array(arc)
    made = at(m, s)
    offset = dict(zip(m.lines, made.offsets, strict=True))
    belted = lambda edge: s <= edge + 1e-9
    pattern = offset["outer"] - offset["groove"]
    smooth = offset["outer"] - VOID * pattern * np.clip(
        (TREAD * max(edges) - s) / ((TREAD - 1) * max(edges)), 0, 1
    )
    rows = {"inner": offset["inner"], "ply": 0 * s}
    for k, edge in enumerate(m.belts, 1):
        rows["belt1_turn_up" if k == 1 else f"belt{k}"] = np.where(
            belted(edge), offset[f"belt_{k}"], np.nan
        )
    if not truck:
        rows["cap"] = np.where(belted(max(edges)), offset["cap"], np.nan)
    rows["base"] = np.where(belted(max(edges)), offset["base"], np.nan)
    turned = s >= marks["turn_up" if truck else "widest"] - 1e-9
    rows["belt1_turn_up"] = np.where(turned, offset["belt_1"], rows["belt1_turn_up"])
    rows["outer"] = smooth
    carcass_line = made.points[m.lines.index("ply")]
    rigid = s >= marks["rim"] - 1e-9
    return GaugeTable(
        tuple(rows), "ply", carcass_line, np.stack(list(rows.values())), labels, rigid
    )
