"""Study 3 scored: tyres of none to three effects, and outside the catalogue, against the answers.

lambda of one effect of several: of what it moves while the others are there, against the ruler's
full covariance. Its group: the effect, and those that the ruler cannot tell from it.
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
from tyrecal.studies.blind.protocol import Protocol, open_truth, read_json, read_protocol
from tyrecal.studies.blind.ruler import Difficulty, Ruler, difficulty, read_ruler
from tyrecal.studies.blind.score import held_out_error, means, true_shift
from tyrecal.studies.diagnose.several import present
from tyrecal.studies.diagnose.verdict import SET
from tyrecal.studies.fit.targets import labels_to_measure
from tyrecal.studies.inference.inverse_problem import Assumed

from ...studies.blind_least_squares import held_out, held_out_rms
from .cases import further, weighed_again
from .laws import CLAMP

ONE, EACH = 25.0, 15.0  # lambda from which one effect, and each of a pair, should be found
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
        """Largest possible value of `usual_shrinkage`; NaN if it is unknown."""
        return 1 - self.least / (self.usual or (1.0,))[0]


def scored(folder: Path, sealed: Path) -> list[Scored]:
    """Every trial of a group. Raises InputError."""
    content, protocol = open_truth(folder, sealed), read_protocol(folder)
    labels = labels_to_measure(case_of(folder))
    ruler = read_ruler(folder)
    answer_of = lambda truth: read_json(folder / "answers" / f"{truth['id']}.json")
    return [one(t, answer_of(t), folder, ruler, protocol, labels) for t in content["trials"]]


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
        moved = moved_by(id, truth, ruler, places)
        hard[id] = difficulty(ruler, protocol, id, d, places, counts, moved)
    if truth["kind"] == "outside":
        moved = true_shift(truth, ruler, places)
        hard["outside"] = difficulty(ruler, protocol, "outside", d, places, counts, moved)
    diagnosis, out = answer["diagnosis"], answer["held_out"]
    p, named = diagnosis["probabilities"], diagnosis["effect"]
    sizes = diagnosis["parameters"] if named else {}
    equal = {id: h.equivalent for id, h in hard.items()}
    held = lambda true: tuple(
        sizes[id]["low"] <= value <= sizes[id]["high"]
        for id, value in true.items()
        if id in sizes and value is not None
    )
    error = lambda key: held_out_error(truth["held_out"], out[key] or out["plain_Hz"])
    score = Scored(
        truth["id"],
        truth["kind"],
        effects,
        hard,
        diagnosis["verdict"],
        named,
        bool((diagnosis.get("robust") or {}).get("robust")),
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
        moved = true_shift(truth, ruler, places)
        whole = difficulty(ruler, protocol, effects[0], d, places, counts, moved)
        score = replace(score, together=whole.lam)
    score = replace(
        weighed(score, p),
        foretold=foretold(truth, out, protocol.held_out_kPa),
        if_told=weighed(score, again),
    )
    if truth["swapped"] or diagnosis["exchanged_labels"]:
        return score
    there = held_out(truth, ruler, protocol, labels)
    with_effects = {id: each["value"] for id, each in diagnosis["parameters"].items()}
    rms = lambda sizes: held_out_rms(ruler, y, places, there, sizes)
    score = replace(score, usual=(rms({}), rms(with_effects)))
    if len(effects) != 1 or hard[effects[0]].lam < ONE or effects[0] not in ruler.signatures:
        return score
    (id,) = effects
    sizes = np.linspace(*ruler.signatures[id].sizes[[0, -1]], SIZES_TRIED)
    return replace(score, least=min(rms({id: float(e)}) for e in sizes))


def moved_by(
    id: str, truth: Mapping[str, Any], ruler: Ruler, places: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """`true_shift` of one effect, alone or beside the others that are there."""
    table = truth["members"].get(id, truth["without"])
    return true_shift({**truth, "without": table}, ruler, places)


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
