"""A diagnosis on one page, in words for an engineer (Markdown)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..files import json_text
from ..studies.diagnose.diagnosis import Diagnosis
from ..studies.diagnose.evidence import COVERAGE, NONE, OUTSIDE, PRIOR_OUTSIDE
from ..studies.diagnose.gap import OWN_RIM
from ..studies.diagnose.posteriors import constants_posterior
from ..studies.diagnose.result import DiagnosisResult
from ..studies.diagnose.several import PRIOR_NONE, present
from ..studies.diagnose.study import DiagnosedCase
from ..studies.diagnose.under_load import LoadedRow
from ..studies.diagnose.verdict import NAMED, NO_GAP, UNDECIDED, no_gap_words
from ..studies.fit.result import OTHER_RESIDUALS
from ..studies.inference.compressed_cords import compressed_layers
from ..studies.inference.damping import DAMPING_FORM
from ..tyre.footprint_quantities import FOOTPRINT_QUANTITIES
from ..units import display_unit, in_engineers_units, signed
from .shape_data import parts_data
from .table import map_resolution

RUNGS = {
    1: "consistent with the data to which it was fitted",
    2: "predictive: it lowers the error on held-out data by more than chance",
    3: "corroborated: its size agrees with an independent measurement",
    4: "shown to be the cause: changing it moved the frequencies as predicted",
}
SHOWN = 6  # candidates at most
GROUP_WORDS = {  # names in diagnosis.json that the page has in the words of the guides
    "lateral": "out-of-plane",
    "lateral less in-plane": "out-of-plane less in-plane",
    "slope over the harmonic, c = 4 over c = 1": "growth over the harmonic, c = 4 over c = 1",
}


def further_files(study: DiagnosedCase, result: DiagnosisResult, measured: Path) -> dict[str, str]:
    """diagnosis.md, and diagnosis_section.json, the drawing of the section, by name."""
    case, of = study.model.case, result.provenance
    parts = parts_data(case, [part.region for part in result.section_map])
    content = parts.model_copy(update={"provenance": of}).model_dump(exclude_unset=True)
    return {
        "diagnosis_section.json": json_text(content),
        "diagnosis.md": page(study, case.case.name, measured.name),
    }


def page(study: DiagnosedCase, case: str, measured: str) -> str:
    """The page as Markdown."""
    d = study.diagnosis
    parts = [
        f"# What the model of {case} lacks"
        if d.verdict.kind == NAMED
        else f"# The model of {case} against its measurements",
        f"Measurements: {measured}, {_counted(d)}.",
        f"## {_headline(study)}",
        *_answer(study),
        *_labels(study),
        "## Is there a gap?",
        *_gap(d),
        "## Where is it?",
        *_where(d),
        *_fields(study),
        *_under_load(study),
        "## Which effect?",
        *_which(study),
        "## How far does the error shrink?",
        *_shrinkage(d),
        "## The calibrated variables",
        *_variables(study),
        "## What to measure next",
        *_next(d),
        "## Assumptions",
        *_assumptions(study),
    ]
    return "\n\n".join(parts) + "\n"


def _counted(d: Diagnosis) -> str:
    """The measurements in words: number of modes, pressures, rims and runs."""
    rows = d.problem.observations.rows
    pressures = sorted({row.pressure_kPa for row in rows if row.label})
    modes = len({row.label for row in rows if row.label})
    at = ", ".join(f"{p:g}" for p in pressures)
    runs = 1 + len(d.problem.changes)
    rims = dict.fromkeys(row.rim or OWN_RIM for row in rows if row.label)
    held = f", rim {' and '.join(rims)}" if len(rims) > 1 else ""
    held += f", {d.damping_ratios} damping ratios" if d.damping_ratios else ""
    return f"{modes} modes at {at} kPa{held}" + (f", {runs} runs" if runs > 1 else "")


def _title(study: DiagnosedCase, key: str) -> str:
    ranges = study.diagnosis.problem.ranges
    words = {NONE: "no effect at all", OUTSIDE: "not explained by the catalogue"}
    if key in words:
        return words[key]
    return " and ".join(ranges[id].title or id for id in key.split("+"))


def _headline(study: DiagnosedCase) -> str:
    """The verdict as a headline."""
    v = study.diagnosis.verdict
    if v.kind == NAMED and v.key:
        others = " or ".join(_title(study, each.id) for each in v.also)
        return f"Named: {_title(study, v.key)}" + (f", and perhaps {others}" if others else "")
    if v.kind == UNDECIDED:
        return "Undecided"
    if v.kind == NO_GAP:
        return no_gap_words(study.diagnosis.probabilities[NONE]).capitalize()
    return "Not explained by the catalogue"


def _answer(study: DiagnosedCase) -> Iterator[str]:
    """Sentences of the first section: the verdict, and what speaks for it."""
    d = study.diagnosis
    v, p = d.verdict, d.probabilities
    if study.asked_for is not None:
        names = ", ".join(f"`{id}`" for id in study.asked_for) or "nothing"
        yield f"Considered, by your choice: only {names} of the catalogue, no other effect."
    if d.exchanged:
        a, b = d.exchanged
        yield (
            f"By the model, the labels {a.display} and {b.display} are exchanged in the file;"
            " check the shapes. The results below use the exchanged labels."
        )
    if v.kind == NAMED and v.key:
        ids = v.key.split("+")
        sizes = "; ".join(_sized(d, v.key, id) for id in ids)
        are = "are" if len(ids) > 1 else "is"
        yield (
            f"{_title(study, v.key)} (`{v.key}`) {are} part of the explanation with probability"
            f" {present(p, ids):.2f}, alone with {p[v.key]:.2f}; {sizes}."
        )
        for each in v.also:
            yield (
                f"Perhaps there too: {_title(study, each.id)} (`{each.id}`), probability"
                f" {each.probability:.2f}."
            )
    elif v.kind == NO_GAP:
        yield (
            "Repeatability, model error and uncalibrated constants explain what the calibration"
            " leaves."
        )
    else:
        yield v.words[0].upper() + v.words[1:] + "."
    if v.kind in (UNDECIDED, NAMED) and len(v.candidates) > 1:
        names = ", ".join(f"`{key}`" for key in v.candidates[:SHOWN])
        more = len(v.candidates) - SHOWN
        tail = f" and {more} more" if more > 0 else ""
        yield f"These explanations have 90 % of the probability: {names}{tail}."
    yield _robust(d)
    yield from _constants(d)
    if v.kind == NAMED:
        yield f"Rung {d.rung} of 4 (strength of the proof): {RUNGS[d.rung]}."
        if d.rung < 4 and v.key:
            ways = [d.problem.ranges[id].toggle or f"measure again without {id}" for id in ids]
            yield (
                "Frequencies of one state of the tyre cannot prove a cause. To prove it:"
                f" {'; and '.join(ways)}. Give the second run with `--toggled`."
            )


def _labels(study: DiagnosedCase) -> Iterator[str]:
    """Labels of the frequencies that came without one."""
    if study.labels is None:
        return
    table = study.labels.table()
    rows = [[column.name for column in table.columns], ["---"] * len(table.columns), *table.rows]
    yield "## Which labels?"
    yield "\n".join(f"| {' | '.join(str(cell or '') for cell in row)} |" for row in rows)
    words = "; ".join(study.labels.sentences())
    yield (
        f"{words[0].upper()}{words[1:]}. Labels and effects are found together. The probabilities"
        " of the effects are averages over all labelings of at least 1 % for the plain tyre. All"
        " other results use the likeliest labeling."
    )


def _robust(d: Diagnosis) -> str:
    """Dependence of the verdict on the assumptions."""
    robust, key = d.robustness, d.verdict.key or d.verdict.best
    words = {NO_GAP: "no effect", OUTSIDE: "an unlisted cause"}
    of = words.get(d.verdict.kind, f"`{key}`")
    between = f"the probability of {of} is between {robust.low:.2f} and {robust.high:.2f}"
    if robust.robust and d.exchanged:
        return (
            "The verdict depends on labels that are exchanged here: correct the file before you"
            f" use the verdict; {between}."
        )
    if robust.robust:
        labels = " under every likely labeling," if len(d.readings) > 1 else ""
        return (
            "Robust: the verdict does not change with every prior and every constant's standard"
            f" deviation half and twice as large, without model error,{labels} and with each mode"
            f" left out; {between}."
        )
    more = len(robust.hangs_on) - SHOWN
    tail = f"; and {more} more" if more > 0 else ""
    return (
        f"The verdict depends on {'; '.join(robust.hangs_on[:SHOWN])}{tail}. In all cases,"
        f" {between}."
    )


def _constants(d: Diagnosis) -> Iterator[str]:
    """Constants that the data move, reported and not named."""
    moved = [each for each in constants_posterior(d) if abs(each.shift_in_sd) >= 1]
    if moved:
        names = ", ".join(
            f"{e.name.replace('_', ' ')} {e.shift_in_sd:+z.1f}" for e in moved[:SHOWN]
        )
        yield (
            f"Constants that the data move by one standard deviation or more (not causes): {names}."
        )


def _sized(d: Diagnosis, key: str, id: str) -> str:
    """The size of the effect ``id`` of ``key`` amid a sentence."""
    q, base = d.parameter(key, id), d.problem.ranges[id].base
    whose = f"the size of `{id}`" if "+" in key else "its size"
    has = in_engineers_units(base, q["unit"])
    held = f", including the {has} of the case" if base else ""
    unit, factor = display_unit(q["unit"])
    value, low, high = (f"{factor * q[key]:.3g}" for key in ("value", "low", "high"))
    sd = d.problem.ranges[id].prior_sd
    times = abs(q["value"] - base) / sd if sd else 0.0
    beyond = f", {times:.1f} times the standard deviation of the case" if sd else ""
    return f"{whose} is {f'{value} {unit}'.rstrip()}, 90 % between {low} and {high}{beyond}{held}"


def _gap(d: Diagnosis) -> Iterator[str]:
    """Sentences on the misfit that the calibration leaves."""
    g = d.gap
    seen = "larger than" if g.p_value < 0.05 else "within"
    yield (
        f"The misfit after calibration is {g.rms_percent:.2f} % (rms). That is {seen} what"
        f" repeatability, model error and uncalibrated constants explain: chi2 {g.chi2:.1f} for"
        f" {g.freedom} degrees of freedom, p = {g.p_value:.2g}. The verdict does not depend on"
        " this figure, because it is weak against a single effect."
    )
    yield OTHER_RESIDUALS
    hidden = sorted((id for id, a in g.absorbed.items() if a > 0.9), key=lambda id: -g.absorbed[id])
    for id in hidden[:3]:
        moved = {name: bias[id] for name, bias in g.bias_percent.items()}
        worst = max(moved, key=lambda name: abs(moved[name]))
        if abs(moved[worst]) > 1:
            yield (
                f"Calibration hides {100 * g.absorbed[id]:.0f} % of `{id}`: ignored at full size,"
                f" it would move {worst} by {moved[worst]:+z.0f} %."
            )


def _where(d: Diagnosis) -> Iterator[str]:
    """Sentences on the groups of modes with a misfit beyond chance."""
    groups = [g for g in d.gap.groups if g.corrected < 0.05]
    if groups:
        words = ", ".join(
            f"{g.kind} {GROUP_WORDS.get(g.name, g.name)} (rms {g.rms_percent:.2f} %)"
            for g in groups
        )
        yield (
            f"Groups with a misfit beyond chance (corrected for {len(d.gap.groups)} groups):"
            f" {words}."
        )
    else:
        yield (
            f"None of {len(d.gap.groups)} groups of modes has a misfit beyond chance (corrected"
            " for their number)."
        )
    strange = [c for c in d.gap.contrasts if c.p_value < 0.05 / max(1, len(d.gap.contrasts))]
    for c in strange:
        name = GROUP_WORDS.get(c.name, c.name)
        yield f"{name[0].upper() + name[1:]}: {c.percent:+z.2f} % ± {c.sigma_percent:.2f} %."
    if d.parts:
        best = d.parts[0]
        heavier = abs(best.mass_percent / best.mass_sigma) > abs(
            best.stiffness_percent / best.stiffness_sigma
        )
        change = (
            f"mass {best.mass_percent:+z.0f} % ± {best.mass_sigma:.0f} %"
            if heavier
            else f"stiffness {best.stiffness_percent:+z.0f} % ± {best.stiffness_sigma:.0f} %"
        )
        same = f" (looks the same as {', '.join(best.same_as)})" if best.same_as else ""
        if best.evidence > 1:
            yield (
                f"Best change of a single part of the section: {best.region}{same}, {change}, ln"
                f" evidence {best.evidence:+z.1f}."
            )
        else:
            yield (
                "No change in stiffness or mass of a single part of the section explains the"
                " misfit."
            )
        finer = " The data do not support a finer map." if d.effective_rank else ""
        yield map_resolution(d.effective_rank) + finer


def _fields(study: DiagnosedCase) -> Iterator[str]:
    """The section as the data describe it."""
    rows = [
        f"| {v.field} | {v.place.replace('_', ' ')} |"
        f" {signed(v.value, 1 if v.sigma >= 1 else 2)} {v.unit} | {v.sigma:.2g} {v.unit} |"
        f" {v.before:.2g} {v.unit} |"
        for v in study.section
    ]
    if rows:
        yield "The section by these data, if nothing else is wrong:"
        head = "| number | where | likeliest | standard deviation | prior |"
        yield "\n".join([head, "|---|---|---|---|---|", *rows])


def _under_load(study: DiagnosedCase) -> Iterator[str]:
    """Sentences and table on measurements under load, which are not fitted."""
    under_load = study.under_load
    if not under_load:
        return
    heads = {key: f"with `{key}`" if key != NONE else "calibrated" for key in under_load.tyres}
    rms = {key: under_load.rms_percent(key) for key in under_load.tyres}
    off = [f"{heads[key]} {each:.1f} %" for key, each in rms.items() if each is not None]
    if off:
        yield (
            "Measurements under load were not fitted. Their deviation from the model, rms:"
            f" {', '.join(off)}."
        )
        rows = [f"| kPa | N | measured | {' | '.join(f'{head}, %' for head in heads.values())} |"]
        rows.append("|" + "---|" * (3 + len(heads)))
        for row in under_load.rows:
            percent = [f"{100 * row.off[key]:+z.1f}" if key in row.off else "" for key in heads]
            cells = [f"{row.pressure_kPa:g}", f"{row.load_N:g}", _measured(row), *percent]
            rows.append(f"| {' | '.join(cells)} |")
        yield "\n".join(rows)
    for why in under_load.failed:
        key, _, words = why.partition(", ")
        yield f"Under load not computed, {heads[key]}, {words}."


def _measured(row: LoadedRow) -> str:
    percent = f" ± {100 * row.sigma / row.value:.1f} %"
    if row.member:
        return f"{row.member} {row.value:.2f} Hz{percent}"
    quantity = FOOTPRINT_QUANTITIES[row.quantity]
    return f"{quantity.words} {quantity.per_SI * row.value:.1f} {quantity.unit}{percent}"


def _which(study: DiagnosedCase) -> Iterator[str]:
    """Table of the explanations with probability, size and detectability."""
    d = study.diagnosis
    order = sorted(d.probabilities.items(), key=lambda item: -item[1])
    rows = [
        "| explanation | probability | size, 90 % | detectability lambda |",
        "|---|---|---|---|",
    ]
    for key, p in order[:SHOWN]:
        size, seen = "", ""
        if key not in (NONE, OUTSIDE):
            both = [d.parameter(key, id) for id in key.split("+")]
            size = " and ".join(map(_ranged, both))
        if key in d.problem.ranges:
            seen = f"{d.separability.lambdas[key]:.0f}"
        rows.append(f"| {_title(study, key)} | {p:.2f} | {size} | {seen} |")
    yield "\n".join(rows)
    yield (
        "Detectability lambda: squared change by an effect that calibration cannot absorb, in"
        " standard deviations. Below 10 an effect can hide; from 25 on it is usually named."
    )
    for group in d.separability.groups():
        if not set(group) & {id for key in d.verdict.candidates for id in key.split("+")}:
            continue
        names = ", ".join(f"`{id}`" for id in group)
        yield f"These data cannot separate {names}."
    held = [
        f"`{id}` {in_engineers_units(span.base, span.unit)}"
        for id, span in d.problem.ranges.items()
        if span.base
    ]
    if held:
        yield (
            f"The case already contains {', '.join(held)}. Sizes include it; the smallest"
            " detectable sizes below are changes from it."
        )
    likeliest = set((d.verdict.key or d.verdict.best or "").split("+"))
    unseen = [id for id, e in d.separability.smallest.items() if e is None]
    blind = [id for id in unseen if id not in likeliest]
    sizes = [
        f"`{id}` {in_engineers_units(abs(e), d.problem.ranges[id].unit, 2)}"
        for id, e in d.separability.smallest.items()
        if e is not None
    ]
    if sizes:
        yield f"Smallest detectable sizes (lambda = 10): {', '.join(sizes)}."
    if blind:
        names = ", ".join(f"`{id}`" for id in blind)
        yield f"Not detectable with these data at any size in their range: {names}."
    for id in unseen:
        if id in likeliest:
            yield (
                f"`{id}` is the likeliest effect, but these data cannot detect it (lambda is below"
                " 10 at every size in its range). Its probability is mostly prior probability."
            )


def _ranged(q: Mapping[str, Any]) -> str:
    unit, factor = display_unit(q["unit"])
    value, low, high = (f"{factor * q[key]:.3g}" for key in ("value", "low", "high"))
    return f"{value} ({low} to {high}) {unit}".rstrip()


def _shrinkage(d: Diagnosis) -> Iterator[str]:
    """Sentences on the prediction of held-out data."""
    s = d.shrinkage
    if s is None:
        yield "There are too few data for held-out data."
        return
    if d.leading is None:
        yield (
            f"Held-out data (by rule): {s.held_out}. Their error is {s.before_percent:.2f} %;"
            f" repeatability alone would leave {s.floor_percent:.2f} %. There is no gap for an"
            f" effect to close. With the likeliest one, `{s.effect}`, the error would be"
            f" {s.after_percent:.2f} %."
        )
        return
    yield (
        f"Held-out data (by rule): {s.held_out}. Their error is {s.before_percent:.2f} % without"
        f" an effect and {s.after_percent:.2f} % with `{s.effect}`. It shrinks by"
        f" {100 * s.fraction:.0f} % at the likeliest size ({100 * s.low:.0f} to {100 * s.high:.0f}"
        " % for 90 % of the sizes and designs that fit the other data). On tyres without any"
        f" effect, chance shrinks it by up to {100 * s.placebo_95:.0f} % (95 % quantile)."
        f" Repeatability alone would leave {s.floor_percent:.2f} %."
    )
    yield (
        "In these fits the uncalibrated constants may vary within their uncertainty. After an"
        " ordinary least-squares fit the error of the held-out data is"
        f" {s.least_squares_before_percent:.2f} % without the"
        f" effect and {s.least_squares_after_percent:.2f} % with it."
    )


def _variables(study: DiagnosedCase) -> Iterator[str]:
    """Calibrated variables, without and with the effect to which the diagnosis leads."""
    calibrated, key = study.variables, study.diagnosis.leading
    heads = {"without": "without an effect", "with": f"with `{key}`"}
    shown = {head: calibrated[side] for side, head in heads.items() if calibrated[side]}
    rows = [f"| variable | {' | '.join(shown)} |", "|---|" + "---|" * len(shown)]
    rows += [
        f"| {name} | {' | '.join(_calibrated(side[name]) for side in shown.values())} |"
        for name in calibrated["without"]
    ]
    yield "\n".join(rows)
    yield (
        "Values with one standard error from all uncertainties; `tyrecal fit` weights by the"
        " scatter of its targets only."
    )


def _calibrated(variable: Mapping[str, Any]) -> str:
    value, error = variable["value"], variable["standard_error"]
    share = f" \N{PLUS-MINUS SIGN} {100 * error / abs(value):.2g} %" if value else ""
    return in_engineers_units(value, variable["unit"], 4) + share


def _next(d: Diagnosis) -> Iterator[str]:
    """List of the next measurements that gain most per hour."""
    worth = [c for c in d.choices if c.gain > 0][:4]
    if not worth:
        yield "None of the possible measurements would separate the explanations further."
        return
    yield "\n".join(
        f"{i}. {c.what} (about {c.hours:g} h; gain {c.gain:.2g} per hour)"
        for i, c in enumerate(worth, 1)
    )


def _assumptions(study: DiagnosedCase) -> Iterator[str]:
    """Sentences on the numbers that the diagnosis takes for granted."""
    d = study.diagnosis
    kind = "assumed, not in the case" if study.assumed_sources else "stated by the case"
    words = ", ".join(source.words for source in study.sources if source.words) or "none"
    words = words.replace(" degrees", "°")
    yield f"Uncalibrated constants, one standard deviation each ({kind}): {words}."
    a = d.problem.assumed
    form = "as recorded for every mode" if a.form is None else f"{100 * a.form:g} % in every mode"
    if a.form is None and (material := d.problem.expansion.material_laws):
        form += (
            f"; material laws {100 * material:g} % in all modes alike, as much in each family and"
            " in every single mode"
        )
    form += "; smooth over the pressure"
    if slack := compressed_layers(d.sources):
        form += f". Slack cords of {', '.join(slack)} bear none to all of their compression"
    ranges = d.problem.ranges
    laws = sorted({span.response_error for span in ranges.values()})
    law = f"{100 * laws[0]:g} to {100 * laws[-1]:g}" if a.response_error is None and laws else "0"
    second = (
        ", ".join(f"`{id}`" for id, span in ranges.items() if span.has_shape_uncertainty) or "none"
    )
    yield (
        f"Model error: {form}. Error of an effect's law: {law} % of its shift, effect by effect."
        f" Effects with uncertain details, averaged over: {second}. Split of the pairs of every"
        f" tyre: {100 * a.split:g} %."
    )
    yield (
        f"Prior probabilities: no effect {PRIOR_NONE:g}, not explained by the catalogue"
        f" {PRIOR_OUTSIDE:g}. All pairs of effects together have {a.further:g} times the"
        f" probability of all single ones, and all triples {a.further:g} times that of the pairs."
    )
    stated = [f"`{id}`" for id, span in d.problem.ranges.items() if span.prior_sd]
    if stated:
        yield (
            f"The case states {', '.join(stated)} as uncertain. Within {COVERAGE:g} standard"
            " deviations they are uncalibrated constants, beyond that they are effects."
        )
    for id, why in d.problem.expansion.failed.items():
        yield f"`{id}` could not be evaluated: {why}."
    for why in dict.fromkeys(study.inexpressible.values()):
        ids = (f"`{id}`" for id, other in study.inexpressible.items() if other == why)
        yield f"Not considered, {why}: {', '.join(ids)}."
    if study.calibrated:
        names = ", ".join(f"`{id}`" for id in study.calibrated)
        yield f"Not considered, because a variable of the case calibrates them: {names}."
    if d.damping_ratios:
        yield (
            f"Damping ratios: scatter as stated, {100 * DAMPING_FORM:g} % more in every mode,"
            f" {study.model.losses}."
        )
    for left in d.left_out:
        yield f"Left out: {left}."
