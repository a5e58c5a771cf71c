"""Figures of study 3 as tables: rates with their bounds, calibration, shrinkage.

A rate with too few trials is not shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tyrecal.studies.blind.ruler import MIN_LAMBDA_APART
from tyrecal.studies.blind.score import calibration_error, calibration_quantile, rate

from .cases import Group
from .score import EACH, ONE, Scored

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
