"""Reports as `run_case` makes them, for what only reads them."""

from __future__ import annotations

from typing import Any


def entry(
    status: str = "good", cause: str | None = None, words: str | None = None, **quantities: float
) -> dict[str, Any]:
    """A study's entry."""
    return {"status": status, "cause": cause, "words": words, "quantities": quantities}


def report(name: str, **studies: dict[str, Any]) -> dict[str, Any]:
    """A case's report; a second a study."""
    facts = {
        "started": "2026-01-02T03:04:05+00:00",
        "host": "node-1",
        "solver": "bundled 1.0.0",
        "seconds": dict.fromkeys(studies, 1.0),
        "solver_runs": 9,
        "answered_from_record": 0,
    }
    return {"name": name, "provenance": {}, "studies": studies, "facts": facts}
