"""Figures of study 3 as tables: rates with their bounds, calibration, shrinkage.

A rate with too few trials is not shown.

Rises: by how much less or more sound tyres' frequencies rise over the run of pressures than the
ruler's model has it at their own numbers: what other laws, and another section, do to modes alike.
Of every tyre, of those with effects what its maker has of it without them; no noise.

Unlike: how unlike what the makers' effects move is to what the catalogue's do, by the trials'
rulers. Of an effect that moves g, and the catalogue's g_j(e) at the size e that comes closest, in
what calibration leaves of both (P, see `ruler`), two numbers:

    (g - g_j)^T P (g - g_j) / lambda,  lambda = g^T P g;    e over the size that it was made with
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import log
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.measured.tables import read_measurements
from tyrecal.simulate.modes.label import Label
from tyrecal.studies.blind.answer import case_of
from tyrecal.studies.blind.protocol import open_truth, read_protocol
from tyrecal.studies.blind.ruler import MIN_LAMBDA_APART, Ruler, read_ruler
from tyrecal.studies.blind.score import calibration_error, calibration_quantile, means, rate
from tyrecal.studies.inference.uncertainties import sources

from .cases import Group, with_exact_section
from .score import EACH, ONE, Scored, moved_by

Array = np.ndarray


LEAST, LEAST_A_SIZE, LEAST_ROBUST = 60, 40, 100  # trials of a rate that is shown
SIGNIFICANT = 0.95
SHRINKAGES = {
    "least squares": "usual_shrinkage",
    "least squares that know the effect and its best size": "most_shrinkage",
    "the diagnosis": "shrinkage",
}


def table(groups: Mapping[Group, Sequence[Scored]], least: int | None = None) -> str:
    """All figures as Markdown, by whose section it was, then by size; least: trials of a rate that
    is shown, `LEAST` and the like by default."""
    parts: dict[str, list[Scored]] = {"own section": [], "foreign section": [], "both": []}
    sizes: dict[str, list[Scored]] = {}
    for group, trials in groups.items():
        parts["own section" if group.own else "foreign section"] += trials
        parts["both"] += trials
        sizes.setdefault(group.size, []).extend(trials)
    lines = []
    for columns, own, quantile in ((parts, LEAST, 0.95), (sizes, LEAST_A_SIZE, 0.99)):
        enough = (own, quantile, LEAST_ROBUST) if least is None else (least, quantile, least)
        rows = [figures(trials, *enough) for trials in columns.values()]
        lines += [f"| what | {' | '.join(columns)} |", "|---" * (1 + len(columns)) + "|"]
        lines += [f"| {name} | {' | '.join(row[name] for row in rows)} |" for name in rows[0]]
        lines.append("")
    return "\n".join(lines)


def figures(
    trials: Sequence[Scored], least: int, quantile: float = 0.95, least_robust: int = LEAST_ROBUST
) -> dict[str, str]:
    """By what the issue asks, in words; quantile: of a calibrated answerer's calibration error."""
    shown = lambda flags, low=least: _shown(list(flags), low)
    of = lambda kind: [t for t in trials if t.kind == kind]
    none, outside, single = of("none"), of("outside"), of("effect")
    lam = lambda t: min((h.lam for h in t.hard.values()), default=0.0)
    strong, seen = ([t for t in those if lam(t) >= ONE] for those in (single, outside))
    unlike = [t for t in seen if t.hard["outside"].nearest >= MIN_LAMBDA_APART]
    pairs, three = ([t for t in of("several") if len(t.effects) == n] for n in (2, 3))
    named = [t for t in trials if t.verdict == "named" and t.named]
    some = lambda t: t.found((t.named or "").split("+")) > 0
    every = lambda t: t.found((t.named or "").split("+")) == len((t.named or "").split("+"))
    rows = {"no effect: accused": shown(t.verdict == "named" for t in none)}
    for low, high in ((0, 4), (4, 10), (10, ONE), (ONE, np.inf)):
        words = f"one effect, lambda {low:g} to {high:g}: top 1 by group"
        rows[words] = shown(t.right for t in single if low <= lam(t) < high)
    for words, several in (("two", pairs), ("three", three)):
        here = [t for t in several if lam(t) >= EACH]
        rows |= {
            f"{words} effects, each lambda from {EACH:g}: all in the 90 % set": shown(
                t.found(sorted(t.candidates)) == len(t.effects) for t in here
            ),
            f"{words}: one of them named first": shown(t.first_right for t in here),
            f"{words}: likeliest is the truth": shown(t.right for t in here),
            f"{words}: called outside": shown(t.verdict == "outside" for t in here),
            f"{words}, together from {ONE:g}, too: one of them named first": shown(
                t.first_right for t in here if t.together >= ONE
            ),
        }
    robust = [t for t in named if t.robust]
    calibrated = lambda of, stated, right: _calibration(
        *(np.array([getattr(t, key) for t in of], float) for key in (stated, right)),
        least,
        quantile,
    )
    if_told = [t.if_told or t for t in trials]
    proven = [t for t in strong if t.verdict == "named"]
    first = {t.id: t for t in trials}
    again = [(t, first[t.again]) for t in trials if t.again in first]
    return rows | {
        "named: right, or in part of several": shown(some(t) for t in named),
        "named: all of it is there": shown(every(t) for t in named),
        "named: an effect that is there by its own id": shown(
            bool({*(t.named or "").split("+")} & {*t.effects}) for t in named
        ),
        "named and called robust: likewise": shown((some(t) for t in robust), least_robust),
        **{
            f"outside{words}: {answer}": shown(t.verdict in verdicts for t in those)
            for words, those in (
                ("", outside),
                (f", lambda from {ONE:g}", seen),
                (f", lambda from {ONE:g}, like no effect", unlike),
            )
            for answer, verdicts in (
                ("said so, or undecided", ("outside", "undecided")),
                ("named", ("named",)),
            )
        },
        f"calibration error ({100 * quantile:g} % quantile)": calibrated(trials, "stated", "right"),
        "the same, told how many effects tyres have": calibrated(if_told, "stated", "right"),
        "the same of what is named likeliest, whatever else is there": calibrated(
            trials, "there", "in_part"
        ),
        "90 % set holds the truth": shown(t.in_set for t in trials),
        "90 % set holds the truth, told so": shown(t.in_set for t in if_told),
        "90 % interval holds the size": shown(held for t in trials for held in t.held),
        "90 % interval holds a spring's own compliance": shown(
            held for t in trials for held in t.compliances
        ),
        "90 % intervals hold frequencies held out": _mean_share(
            [t.foretold for t in trials if t.foretold and t.kind != "outside"], least
        ),
        **{
            f"held out by {how}, named, lambda from {ONE:g}: median shrinkage": _middle(
                [getattr(t, of) for t in proven], [getattr(t, of) for t in none], least
            )
            for how, of in SHRINKAGES.items()
        },
        "mounted again: the same verdict": shown(
            (a.verdict, a.named) == (b.verdict, b.named) for a, b in again
        ),
    }


def misses(groups: Mapping[Group, Sequence[Scored]]) -> str:
    """Table of the trials that were named wrongly or in part, or missed although the effect moved
    enough."""
    heads = "group", "trial", "truth", "lambda of each", "verdict", "named", "likeliest"
    lines = [f"| missed: {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for group, trials in groups.items():
        for t in trials:
            wrong = t.verdict == "named" and not t.says(t.named or "")
            least = ONE if len(t.effects) == 1 else EACH
            hidden = t.effects and min(h.lam for h in t.hard.values()) >= least and not t.right
            if wrong or hidden:
                truth = "+".join(t.effects) or t.kind
                sizes = ", ".join(f"{h.lam:.0f}" for h in t.hard.values())
                likely = f"{t.ranked[0]} {t.stated:.2f}"
                cells = group.name, t.id, truth, sizes, t.verdict, t.named or "", likely
                lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _shown(flags: Sequence[bool], least: int) -> str:
    if len(flags) < least:
        return _few(len(flags))
    result = rate(flags)
    share, low, high = (f"{100 * result[key]:.0f}" for key in ("share", "low", "high"))
    return f"{result['right']} of {result['count']}, {share} % ({low} to {high})"


def _calibration(stated: np.ndarray, right: np.ndarray, least: int, quantile: float) -> str:
    if len(stated) < least:
        return _few(len(stated))
    error, chance = calibration_error(stated, right), calibration_quantile(stated, quantile)
    return f"{error:.3f} ({chance:.3f})"


def _mean_share(flags: Sequence[Sequence[bool]], least: int) -> str:
    """Share of all flags; its 95 % bounds follow from the scatter between trials, because the flags
    of one trial go together."""
    if len(flags) < max(least, 2):
        return _few(len(flags))
    each = np.array([np.mean(own) for own in flags])
    share, off = 100 * each.mean(), 196 * each.std(ddof=1) / np.sqrt(len(each))
    return f"{share:.0f} % of {len(each)} trials' ({share - off:.0f} to {share + off:.0f})"


def _middle(shrinks: Sequence[float], sound: Sequence[float], least: int) -> str:
    """The median, and what sound tyres reach by chance, where that is known; NaN counts for
    nothing."""
    known, chance = (np.array(each)[np.isfinite(each)] for each in (shrinks, sound))
    if len(known) < least:
        return _few(len(known))
    by_chance = f" (chance {np.quantile(chance, SIGNIFICANT):.2f})" if len(chance) else ""
    return f"{np.median(known):.2f}{by_chance}"


def _few(count: int) -> str:
    return f"not shown ({count})"


def rises(folder: Path, sealed: Path) -> dict[Label, Array]:
    """ln f at the highest pressure less ln f at the lowest, above the model's (tyres,), by mode.
    Raises InputError."""
    content, case = open_truth(folder, sealed), case_of(folder)
    ruler = read_ruler(folder)
    names = [source.name for source in sources(with_exact_section(case))[0]]
    each = [risen(ruler, names, truth) for truth in content["trials"]]
    return {label: np.array([by_label[label] for by_label in each]) for label in each[0]}


def risen(ruler: Ruler, names: Iterable[str], truth: Mapping[str, Any]) -> dict[Label, float]:
    """Rise of each mode of one tyre with pressure beyond the model's, in ln f. names: those of the
    ruler's constants, except the section's, which come after them."""
    every = np.arange(len(ruler.rows))
    x = np.array([log(value) for value in truth["variables"].values()])
    constants = np.array([truth["constants"].get(name, 0.0) for name in names])
    eta = ruler.plain(x - ruler.x0, every)[0] + ruler.constants[:, : len(constants)] @ constants
    model = dict(zip(ruler.rows, eta.tolist(), strict=True))
    table = sorted(truth["without"], key=lambda entry: entry["pressure_kPa"])
    low, high = table[0], table[-1]
    ends = [(entry["pressure_kPa"], entry["ln_f"]) for entry in (low, high)]
    above = lambda label, p, ln_f: float(np.mean(ln_f[str(label)])) - model[label, p]
    return {
        label: above(label, *ends[1]) - above(label, *ends[0])
        for label in dict.fromkeys(label for label, _ in ruler.rows)
        if label
    }


def table_of_rises(by_group: Mapping[Group, Mapping[Label, Array]]) -> str:
    """Medians, per cent, and in parentheses half of what the middle 68 % of the tyres span."""
    labels = list(next(iter(by_group.values())))
    lines = [
        f"| group | tyres | {' | '.join(map(str, labels))} |",
        "|---" * (2 + len(labels)) + "|",
    ]
    for group, modes in by_group.items():
        cells = []
        for label in labels:
            low, middle, high = 100 * np.percentile(modes[label], (16, 50, 84))
            cells.append(f"{middle:+.2f} ({(high - low) / 2:.2f})")
        lines.append(f"| {group.name} | {len(modes[labels[0]])} | {' | '.join(cells)} |")
    return "\n".join(lines)


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
