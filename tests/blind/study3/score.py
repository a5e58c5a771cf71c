"""Study 3 scored: tyres of none to three effects, and outside the catalogue, against the answers.

lambda of one effect of several: of what it moves while the others are there, against the ruler's
full covariance. Its group: the effect, and those that the ruler cannot tell from it. A rate with
too few trials is not shown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log
from pathlib import Path
from typing import Any

import numpy as np

from tyrecal.measured.tables import read_measurements
from tyrecal.studies.blind.answer import case_of
from tyrecal.studies.blind.make import labels_of
from tyrecal.studies.blind.protocol import Protocol, read_json, read_protocol
from tyrecal.studies.blind.ruler import MIN_LAMBDA_APART, Difficulty, Ruler, difficulty, read_ruler
from tyrecal.studies.blind.score import held_out_error, means, true_shift
from tyrecal.studies.blind.seal import open_truth
from tyrecal.studies.blind.statistics import calibration_error, calibration_quantile
from tyrecal.studies.blind.tables import rate
from tyrecal.studies.diagnose.inverse_problem import Assumed
from tyrecal.studies.diagnose.several import present
from tyrecal.studies.diagnose.verdict import SET

from ...studies.blind_least_squares import held_out, held_out_rms
from .cases import Group
from .kinds import further, weighed_again
from .laws import CLAMP

LEAST, LEAST_A_SIZE, LEAST_ROBUST = 60, 40, 100  # trials of a rate that is shown
ONE, EACH = 25.0, 15.0  # lambda from which one effect, and each of a pair, should be found
SIGNIFICANT = 0.95
SHRINKAGES = {
    "least squares": "usual_shrinkage",
    "least squares that know the effect and its best size": "most_shrinkage",
    "the diagnosis": "shrinkage",
}
SIZES_TRIED = 41  # of an effect, for the one that errs least


@dataclass(frozen=True)
class Scored:
    """A trial and its answer. hard: of each effect, or of what is outside the catalogue; ranked:
    keys by falling probability, an id, ids joined by +, none or outside; stated: the first one's;
    there: that of all that it names, whatever else there is; together: lambda of what all of
    several effects move, of which calibration may take up more than of each; right: the first one
    is the truth by groups; held: whether each named and true effect's interval holds what it is
    worth in the catalogue's law; compliances: whether a spring's holds what it was made with;
    before, after: rms error held out, in ln f; usual: the same of least squares, without and with
    what is likeliest, None where labels are exchanged; least: with a strong single effect that is
    there, at the size that errs least, which nobody can know; foretold: whether each frequency held
    out lies in its interval, where the answer has any; if_told: the same, its answer weighed again
    as if the rules had told it how many effects tyres have."""

    id: str
    kind: str  # none, effect, several or outside
    effects: tuple[str, ...]
    hard: Mapping[str, Difficulty]
    verdict: str
    named: str | None
    robust: bool
    ranked: tuple[str, ...]
    stated: float
    candidates: frozenset[str]  # ids, none and outside in the 90 % set
    in_set: bool
    held: tuple[bool, ...]
    before: float
    after: float
    again: str
    usual: tuple[float, float] | None = None
    least: float = np.nan
    foretold: tuple[bool, ...] = ()
    compliances: tuple[bool, ...] = ()
    there: float = 1.0
    together: float = np.inf
    if_told: Scored | None = None

    def found(self, ids: Sequence[str]) -> int:
        """How many true effects are among ids, by their groups, an id for one effect."""
        left, count = list(ids), 0
        for effect in self.effects:
            match = next((id for id in left if id in self.hard[effect].group), None)
            if match:
                left.remove(match)
                count += 1
        return count

    @property
    def right(self) -> bool:
        """The likeliest answer is the truth."""
        return self.says(self.ranked[0])

    @property
    def in_part(self) -> bool:
        """All that the likeliest answer names is there, whatever else is."""
        ids = self.ranked[0].split("+")
        return self.right or self.found(ids) == len(ids)

    @property
    def first_right(self) -> bool:
        """The first effect that is named, or likeliest where none is, is there."""
        return self.found((self.named or self.ranked[0]).split("+")[:1]) > 0

    def says(self, key: str) -> bool:
        """A key is the truth, by groups."""
        ids = key.split("+")
        if not self.effects:
            return key == self.kind
        return self.found(ids) == len(self.effects) == len(ids)

    @property
    def shrinkage(self) -> float:
        return 1 - self.after / self.before

    @property
    def usual_shrinkage(self) -> float:
        """NaN where labels are exchanged."""
        without, with_ = self.usual or (1.0, np.nan)
        return 1 - with_ / without

    @property
    def most_shrinkage(self) -> float:
        """What `usual_shrinkage` could be at most; NaN where it is not known."""
        return 1 - self.least / (self.usual or (1.0,))[0]


def scored(folder: Path, sealed: Path) -> list[Scored]:
    """Every trial of a group. Raises InputError."""
    content, protocol = open_truth(folder, sealed), read_protocol(folder)
    labels = labels_of(case_of(folder))
    ruler = read_ruler(folder, labels)
    told = lambda truth: read_json(folder / "answers" / f"{truth['id']}.json")
    return [one(t, told(t), folder, ruler, protocol, labels) for t in content["trials"]]


def one(
    truth: Mapping[str, Any],
    answer: Mapping[str, Any],
    folder: Path,
    ruler: Ruler,
    protocol: Protocol,
    labels: Sequence[Any],
) -> Scored:
    """One trial."""
    readings = read_measurements(folder / "trials" / f"{truth['id']}.csv")
    y, places, counts = means(readings, ruler)
    d = np.array([log(v) for v in truth["variables"].values()]) - ruler.x0
    hard = {}
    effects = tuple(sorted(truth["effects"])) if truth["kind"] != "outside" else ()
    for id in effects:
        table = truth["members"].get(id, truth["without"])
        shift, split = true_shift({**truth, "without": table}, ruler, places, labels)
        hard[id] = difficulty(ruler, protocol, id, d, places, counts, shift, split)
    if truth["kind"] == "outside":
        shift, split = true_shift(truth, ruler, places, labels)
        hard["outside"] = difficulty(ruler, protocol, "outside", d, places, counts, shift, split)
    said, out = answer["diagnosis"], answer["held_out"]
    p, named = said["probabilities"], said["effect"]
    sizes = said["parameters"] if named else {}
    equal = {id: h.equivalent for id, h in hard.items()}
    held = lambda true: tuple(
        sizes[id]["low"] <= value <= sizes[id]["high"]
        for id, value in true.items()
        if id in sizes and value is not None
    )
    error = lambda key: held_out_error(truth["held_out"], out[key] or out["plain_Hz"])
    found = Scored(
        truth["id"],
        truth["kind"],
        effects,
        hard,
        said["verdict"],
        named,
        bool((said.get("robust") or {}).get("robust")),
        (),
        0.0,
        frozenset(),
        False,
        held(equal),
        error("plain_Hz"),
        error("with_effect_Hz"),
        truth["again"],
        compliances=held({id: truth["effects"][id] for id in effects if id in CLAMP}),
    )
    again = weighed_again(p, answer.get("further", Assumed.further), further(protocol.counts))
    if len(effects) > 1:
        moved, split = true_shift(truth, ruler, places, labels)
        whole = difficulty(ruler, protocol, effects[0], d, places, counts, moved, split)
        found = replace(found, together=whole.lam)
    found = replace(
        weighed(found, p),
        foretold=foretold(truth, out, protocol.held_out_kPa),
        if_told=weighed(found, again),
    )
    if truth["swapped"] or said["exchanged_labels"]:
        return found
    there = held_out(truth, ruler, protocol, labels)
    with_effects = {id: each["value"] for id, each in said["parameters"].items()}
    rms = lambda sizes: held_out_rms(ruler, y, places, there, sizes)
    found = replace(found, usual=(rms({}), rms(with_effects)))
    if len(effects) != 1 or hard[effects[0]].lam < ONE or effects[0] not in ruler.signatures:
        return found
    (id,) = effects
    sizes = np.linspace(*ruler.signatures[id].sizes[[0, -1]], SIZES_TRIED)
    return replace(found, least=min(rms({id: float(e)}) for e in sizes))


def weighed(trial: Scored, p: Mapping[str, float]) -> Scored:
    """The trial with what was said by key of how probable it is."""
    ranked = tuple(sorted(p, key=lambda key: -p[key]))
    totals = np.cumsum([p[key] for key in ranked])
    candidates = ranked[: int(np.searchsorted(totals, SET)) + 1]
    return replace(
        trial,
        ranked=ranked,
        stated=p[ranked[0]],
        there=present(p, ranked[0].split("+")),
        candidates=frozenset(id for key in candidates for id in key.split("+")),
        in_set=any(trial.says(key) for key in candidates),
    )


def foretold(
    truth: Mapping[str, Any], out: Mapping[str, Any], pressure_kPa: float
) -> tuple[bool, ...]:
    """Whether the tyre's own frequencies, without noise, lie in the intervals of an answer; nothing
    where its labels were exchanged, by which intervals are told."""
    if truth["swapped"]:
        return ()
    (true,) = [each for each in truth["with_effect"] if each["pressure_kPa"] == pressure_kPa]
    return tuple(
        low <= np.exp(np.mean(true["ln_f"][name])) <= high
        for name, (_, low, high) in out.get("expected_Hz", {}).items()
    )


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
            f"outside{words}: {said}": shown(t.verdict in verdicts for t in those)
            for words, those in (
                ("", outside),
                (f", lambda from {ONE:g}", seen),
                (f", lambda from {ONE:g}, like no effect", unlike),
            )
            for said, verdicts in (
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
    """What was named wrongly or in part, and what was not found though it moved enough."""
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
    found = rate(flags)
    share, low, high = (f"{100 * found[key]:.0f}" for key in ("share", "low", "high"))
    return f"{found['right']} of {found['count']}, {share} % ({low} to {high})"


def _calibration(stated: np.ndarray, right: np.ndarray, least: int, quantile: float) -> str:
    if len(stated) < least:
        return _few(len(stated))
    error, chance = calibration_error(stated, right), calibration_quantile(stated, quantile)
    return f"{error:.3f} ({chance:.3f})"


def _mean_share(flags: Sequence[Sequence[bool]], least: int) -> str:
    """Of all flags; its 95 % bounds by the scatter from trial to trial, whose flags go together."""
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
