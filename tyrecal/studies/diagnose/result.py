"""The diagnosis as the content of diagnosis.json."""

from __future__ import annotations

from typing import Any

import numpy as np

from .diagnosis import Diagnosis
from .evidence import NONE
from .gap import projection
from .under_load import UnderLoad


def result(
    diagnosis: Diagnosis,
    under_load: UnderLoad | None = None,
    calibrated: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Plain data; numbers in the units of their names, None where there is none.

    ``detectability`` is lambda at the sizes in ``judged_at``; ``full_size`` at the far end of each
    range; ``smallest_visible``: the least change from the case with lambda = 10. ``bias_percent``:
    the effect at full size and ignored. ``parameters``: of every effect of a pair. Sizes count in
    what the case has of an effect. ``calibrated``: see `calibrated_variables`.
    """
    d, gap, s = diagnosis, diagnosis.gap, diagnosis.shrinkage
    best = d.best
    named = d.verdict.key
    by = {
        kind: {g.name: g.rms_percent for g in gap.groups if g.kind == kind}
        for kind in ("family", "harmonic", "pressure")
    }
    return {
        "format": 1,
        "verdict": d.verdict.kind,
        "words": d.verdict.words,
        "effect": named,
        "parameter": _parameter(d, named or best),
        "parameters": {
            id: d.parameter(key, id) for key in [named or best] if key for id in key.split("+")
        },
        "likeliest": best,
        **({"calibrated": calibrated} if calibrated else {}),
        "probabilities": _sorted(d.probabilities),
        "candidate_set": list(d.verdict.candidates),
        "fit_p_value": d.verdict.check,
        "groups": d.separability.groups(),
        "detectability": dict(d.separability.lambdas),
        "judged_at": {id: d.problem.spans[id].base + e for id, e in d.separability.sizes.items()},
        "full_size": dict(d.separability.full),
        "smallest_visible": dict(d.separability.smallest),
        "gap": {
            "p_value": gap.p_value,
            "chi2": gap.chi2,
            "freedom": gap.freedom,
            "rms_percent": gap.rms_percent,
            "by_family": by["family"],
            "by_harmonic": by["harmonic"],
            "by_pressure": by["pressure"],
            "by_load": _by_load(under_load),
            "groups": [
                {"kind": g.kind, "name": g.name, "p_value": g.p_value, "holm": g.corrected}
                for g in gap.groups
            ],
            "contrasts": [
                {"name": c.name, "percent": c.percent, "sigma_percent": c.sigma_percent}
                for c in gap.contrasts
            ],
            "residuals": [
                {"row": str(row), "run": row.run, "percent": 100 * r, "sigma_percent": 100 * sd}
                for row, r, sd in zip(
                    d.problem.observations.rows,
                    gap.residuals.tolist(),
                    gap.spread.tolist(),
                    strict=True,
                )
            ],
        },
        "under_load": _under_load(under_load),
        "section_map": [
            {
                "region": p.region,
                "stiffness_percent": p.stiffness_percent,
                "stiffness_sigma": p.stiffness_sigma,
                "mass_percent": p.mass_percent,
                "mass_sigma": p.mass_sigma,
                "evidence": p.evidence,
                "same_as": list(p.same_as),
            }
            for p in d.parts
        ],
        "effective_rank": d.effective_rank,
        "shrinkage": None
        if s is None
        else {
            "held_out": s.held_out,
            "effect": s.effect,
            "before_percent": s.before_percent,
            "after_percent": s.after_percent,
            "fraction": s.fraction,
            "low": s.low,
            "high": s.high,
            "placebo_95": s.placebo_95,
            "floor_percent": s.floor_percent,
            "before_sigma": s.before_sigma,
            "after_sigma": s.after_sigma,
            "least_squares_before_percent": s.least_squares_before_percent,
            "least_squares_after_percent": s.least_squares_after_percent,
        },
        "rung": d.rung,
        "absorbed": dict(gap.absorbed),
        "bias_percent": {name: dict(by_effect) for name, by_effect in gap.bias_percent.items()},
        "next_measurements": [
            {"what": c.what, "gain": c.gain, "hours": c.hours} for c in d.choices
        ],
        "exchanged_labels": [str(label) for label in d.exchanged or ()],
        "left_out": list(d.problem.observations.left_out),
        "not_evaluated": dict(d.problem.expansion.failed),
    }


def _by_load(found: UnderLoad | None) -> dict[str, float]:
    """rms of the calibrated tyre's deviations, per cent, by load in N."""
    if found is None:
        return {}
    rms = {row.load_N: found.rms_percent(NONE, row.load_N) for row in found.rows}
    return {f"{load:g}": value for load, value in sorted(rms.items()) if value is not None}


def _under_load(found: UnderLoad | None) -> dict[str, Any] | None:
    if found is None:
        return None
    effect = found.tyres[1] if len(found.tyres) > 1 else None
    off = lambda row, tyre: 100 * row.off[tyre] if tyre in row.off else None
    return {
        "effect": effect,
        "rows": [
            {
                "quantity": row.quantity,
                "mode": str(row.member) if row.member else None,
                "pressure_kPa": row.pressure_kPa,
                "load_N": row.load_N,
                "measured": row.value,
                "sigma": row.sigma,
                "calibrated_percent": off(row, NONE),
                "effect_percent": off(row, effect),
            }
            for row in found.rows
        ],
        "calibrated_rms_percent": found.rms_percent(NONE),
        "effect_rms_percent": found.rms_percent(effect) if effect else None,
        "failed": list(found.failed),
    }


def _parameter(diagnosis: Diagnosis, key: str | None) -> dict[str, Any] | None:
    if key is None:
        return None
    own = diagnosis.parameter(key)
    hypothesis = diagnosis.hypothesis(key)
    effects = {id: np.array([e]) for id, e in hypothesis.mean().items()}
    shift = diagnosis.bare.added(effects, 1)[0][0] - diagnosis.bare.added({}, 1)[0][0]
    P, _, _ = projection(diagnosis.bare, hypothesis.fitted.d[hypothesis.best])
    return {"effect": key.split("+")[0], **own, "lambda": float(shift @ P @ shift)}


def _sorted(probabilities: Any) -> dict[str, float]:
    """Likeliest first; none and outside always, others that hold a millionth."""
    order = sorted(probabilities.items(), key=lambda item: -item[1])
    return {key: p for key, p in order if p > 1e-6 or key in ("none", "outside")}
