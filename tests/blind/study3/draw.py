"""Truth of each tyre of study 3, drawn at random, and the tyre itself.

`powers` are effects that the trials could show, before anything is measured:
lambda of each effect over its range, by the ruler at the start design: from 25 on the studies on
record named 95 of 100, from 10 on it is seen, below 4 it is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tyrecal.errors import InputError
from tyrecal.studies.blind.make import Trial, Truth, draw, plain_trial, tyre
from tyrecal.studies.blind.protocol import Protocol
from tyrecal.studies.blind.ruler import Ruler, difficulty
from tyrecal.studies.blind.score import true_shift
from tyrecal.studies.inference.separability import VISIBLE, smallest
from tyrecal.studies.inference.uncertainties import sources
from tyrecal.tyre.case import LoadedCase

from .cases import EFFECTS_OF, Group, with_exact_section
from .laws import CLAMP, EVIDENT, EVIDENT_FROM, OUTSIDE, OwnLaw, laws, rim_width
from .score import EACH, ONE
from .section import columns, mould, off
from .tyre import Tyre, tyre_of

Array = np.ndarray


CLAMPED = 0.5  # share of effects of the wheel's clamp, which a doubtful section hides least
FORESEEN = {
    "one_faint": (4.0, 10.0),
    "one_weak": (10.0, ONE),
    "one_strong": (ONE, np.inf),
    "two_strong": (EACH, np.inf),
    "three_strong": (EACH, np.inf),
}  # from which lambda to which, of each effect
MAX_DRAWS = 10_000
SEAT_m, GAUGE_kPa, ROOM_K = 0.4e-3, 0.5, 1.0  # of a mounting: beads apart, pressure, temperature


@dataclass(frozen=True)
class Drawn:
    """kind: of `EFFECTS_OF`; truth: with kind "several" where effects are more than one, its law
    their ids joined by +; effects: sizes by id, of a family outside the catalogue too; mounting,
    redraw: seeds; again: the trial that measured the same tyre first."""

    kind: str
    truth: Truth
    effects: dict[str, float]
    mounting: int
    redraw: int
    again: str = ""


def known_laws(case: LoadedCase, group: Group) -> tuple[dict[str, OwnLaw], dict[str, OwnLaw]]:
    """Effects, and families outside, that this tyre can have."""
    truck = "22.5" in group.size
    outside = {k: law for k, law in OUTSIDE.items() if not (truck and k == "shrunk_cords")}
    return laws(case), outside  # of a truck no cord is textile


def drawn(
    protocol: Protocol,
    case: LoadedCase,
    group: Group,
    counts: Mapping[str, int],
    seed: int,
    ruler: Ruler | None = None,
) -> list[Drawn]:
    """All trials by the order of their ids. counts: by kind (`EFFECTS_OF`), and "again": tyres of
    one effect that are mounted and measured once more. ruler: for those of `FORESEEN`."""
    random = np.random.default_rng(seed)
    kinds = [kind for kind in EFFECTS_OF for _ in range(counts.get(kind, 0))]
    draws = [one_drawn(protocol, case, group, kind, random, ruler) for kind in kinds]
    ones = [each for each in draws if EFFECTS_OF[each.kind] == 1]
    for each in ones[: counts.get("again", 0)]:
        other = replace(
            each.truth, id=random.bytes(6).hex(), scatter=int(random.integers(2**63)), swapped=False
        )
        again = replace(each, truth=other, mounting=int(random.integers(2**63)))
        draws.append(replace(again, again=each.truth.id))
    return sorted(draws, key=lambda each: each.truth.id)


def one_drawn(
    protocol: Protocol,
    case: LoadedCase,
    group: Group,
    kind: str,
    random: np.random.Generator,
    ruler: Ruler | None,
) -> Drawn:
    """A trial of a kind; one of `FORESEEN` has its effects drawn until the ruler foresees such a
    lambda of each. Raises InputError where it never does."""
    rules, known_sources = replace(protocol, counts={"none": 1}), sources(with_exact_section(case))
    (truth,) = draw(rules, case, known_sources[0], {}, {}, int(random.integers(2**63)))
    effects, outside = known_laws(case, group)
    known = {"outside": outside, "outside_strong": EVIDENT}.get(kind, effects)
    number = EFFECTS_OF[kind] or int(kind != "none")
    smallest = EVIDENT_FROM if kind == "outside_strong" else protocol.smallest
    names, clamped = sorted(known), len(set(CLAMP) & set(known))
    share = CLAMPED if clamped else 0.0
    chances = [
        share / clamped if id in CLAMP else (1 - share) / (len(names) - clamped) for id in names
    ]
    for _ in range(MAX_DRAWS):
        ids = sorted(random.choice(names, number, replace=False, p=chances).tolist())
        sizes = {id: known[id].drawn(random, smallest) for id in ids}
        if kind not in FORESEEN:
            break
        assert ruler is not None
        lam = [foreseen(ruler, protocol, truth, id, size) for id, size in sizes.items()]
        low, high = FORESEEN[kind]
        if low <= min(lam) < high:
            break
    else:
        raise InputError(f"no effects of kind {kind} could be seen, by the ruler")
    stated_kind = {0: kind.removesuffix("_strong"), 1: "effect"}.get(EFFECTS_OF[kind], "several")
    size = next(iter(sizes.values()), 0.0)
    truth = replace(truth, kind=stated_kind, law="+".join(ids), size=size)
    return Drawn(kind, truth, sizes, *(int(random.integers(2**63)) for _ in range(2)))


def foreseen(ruler: Ruler, protocol: Protocol, truth: Truth, id: str, size: float) -> float:
    """lambda of the catalogue's effect of this size on a tyre with all of its labels; 0 where the
    ruler does not know it."""
    signature = ruler.signatures.get(id)
    if signature is None:
        return 0.0
    places, d = measured_places(ruler, protocol), np.log([*truth.variables.values()]) - ruler.x0
    sizes, shift, split = signature.grid(d, places)
    at = lambda table: np.array([np.interp(size, sizes, column) for column in table.T])
    return seen(ruler, protocol, truth, at(shift), at(split))


def measured_places(ruler: Ruler, protocol: Protocol) -> np.ndarray:
    """The ruler's rows (n,) at the pressures that are given."""
    return np.array([i for i, (_, p) in enumerate(ruler.rows) if p != protocol.held_out_kPa])


def seen(
    ruler: Ruler, protocol: Protocol, truth: Truth, shift: np.ndarray, split: np.ndarray
) -> float:
    """lambda of what moves `measured_places` by shift (n,), and pairs apart by split (n,)."""
    places = measured_places(ruler, protocol)
    labels = [ruler.rows[i][0] for i in places]
    counts = np.array([2 if label and label.c else 1 for label in labels])
    d = np.log([*truth.variables.values()]) - ruler.x0
    return difficulty(ruler, protocol, truth.law, d, places, counts, (shift, split)).lam


def evident(trial: Trial, protocol: Protocol, ruler: Ruler | None) -> bool:
    """Whether what is outside the catalogue moves as much as one effect that should be found."""
    assert ruler is not None
    plain, places = plain_trial(trial), measured_places(ruler, protocol)
    return seen(ruler, protocol, trial.truth, *true_shift(plain, ruler, places)) >= ONE


def drawn_anew(
    each: Drawn,
    protocol: Protocol,
    case: LoadedCase,
    group: Group,
    tries: int,
    ruler: Ruler | None = None,
) -> Drawn:
    """Another tyre of its kind for a trial whose tyre has no solution, the same for whoever is
    measured again; tries: how many had none."""
    random = np.random.default_rng([each.redraw, tries])
    other = one_drawn(protocol, case, group, each.kind, random, ruler)
    own = each.truth
    truth = replace(other.truth, id=own.id, scatter=own.scatter, swapped=own.swapped)
    return replace(each, truth=truth, effects=other.effects)


def made(each: Drawn, case: LoadedCase, group: Group, without: tuple[str, ...] = ()) -> Tyre:
    """The tyre, some of its effects left out. Raises ValueError where no such tyre can be.

    Its own geometry goes with its constants, so that the same tyre mounted again has it, too.
    """
    truth, case = each.truth, with_exact_section(case)
    own_sources, _ = sources(case)
    nominal = case.file_data["pressure_kPa"]
    plain = tyre(truth, case, own_sources, nominal, None)
    moulded = mould(group.size)
    constants = np.array([*truth.variables.values(), *truth.constants.values()])
    random = np.random.default_rng(np.frombuffer(constants.tobytes(), np.uint32))
    built = tyre_of(plain, off(moulded, random, *group.off), columns(moulded))
    mounting = np.random.default_rng(each.mounting)
    built = rim_width(built, SEAT_m * mounting.normal())
    shift = built.shift_Pa + 1e3 * GAUGE_kPa * mounting.normal()
    built = replace(built, shift_Pa=shift, kelvin=ROOM_K * mounting.normal())
    effects, outside = known_laws(case, group)
    for id, size in each.effects.items():
        if id not in without:
            built = {**effects, **outside, **EVIDENT}[id].add(built, size)
    return built


NAMED_AS_A_RULE = 25.0  # lambda


@dataclass(frozen=True)
class Power:
    """Power of a test for one effect: lambda at the far end of its range where that is larger;
    sizes from which it is seen and, as a rule, named, None beyond the range; effects that it is
    hardly told from."""

    id: str
    full: float
    seen: float | None
    named: float | None
    alike: tuple[str, ...]


def powers(ruler: Ruler, protocol: Protocol) -> list[Power]:
    """Power for every effect, the largest lambda first."""
    given = [i for i, (label, p) in enumerate(ruler.rows) if not label or p in protocol.given_kPa]
    places = np.array(given)
    labels = [ruler.rows[i][0] for i in given]
    counts = np.array([2 if label and label.c else 1 for label in labels])
    start = np.zeros(len(ruler.x0))
    result = []
    for id, signature in ruler.signatures.items():
        sizes, shift, split = signature.grid(start, places)
        hard = [
            difficulty(ruler, protocol, id, start, places, counts, moved)
            for moved in zip(shift, split, strict=True)
        ]
        lengths = np.array([each.lam for each in hard])
        far = hard[int(np.argmax(lengths))]
        seen, named = (smallest(sizes, lengths, least) for least in (VISIBLE, NAMED_AS_A_RULE))
        result.append(Power(id, far.lam, seen, named, far.group[1:]))
    return sorted(result, key=lambda power: -power.full)
