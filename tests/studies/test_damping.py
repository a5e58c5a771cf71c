"""The record of what damping tells: sealed, as the page states it, and no loss to frequencies."""

from __future__ import annotations

import re

from .damping import BENCHMARKS, WAYS, scored


def test_the_page_has_the_figures_of_the_sealed_record() -> None:
    """`scored` compares the truth with its seal."""
    page = (BENCHMARKS / "DAMPING.md").read_text(encoding="utf-8")
    given = page.partition("damping_sound.jsonl -->")[2].partition("\n\n")[0]
    rows = [[int(n) for n in re.findall(r"\| (\d+)", line)] for line in given.splitlines()[3:]]
    counts, sound = scored(), scored("damping_sound")
    accused = {way: counts[way]["accused"] + sound[way]["accused"] for way in WAYS}
    kept = "top", "pair", "named", "wrong"
    assert rows == [[*(counts[way][key] for key in kept), accused[way]] for way in WAYS]
    assert counts[WAYS[0]]["sound"] + sound[WAYS[0]]["sound"] == 120
    alone, stated, unknown = (counts[way]["top"] / counts[way]["effects"] for way in WAYS)
    assert stated > alone + 0.05 and unknown >= alone
    assert all(counts[way]["pair"] > 0.9 * counts[way]["effects"] for way in WAYS)
