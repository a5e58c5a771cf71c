"""A sample of `own_deck_fuzz`: a damaged deck is refused in one sentence, or read."""

from __future__ import annotations

import pytest

from . import own_deck_fuzz


def test_no_damaged_deck_ends_in_a_traceback(request: pytest.FixtureRequest) -> None:
    mutants = own_deck_fuzz.draw(30, request.config.getoption("--seed"))
    assert not [(kind, how) for kind, how, *_ in mutants if how not in ("refused", "read")]


def test_sizes_beyond_a_machine_are_refused() -> None:
    """Each refusal is within the limits of time and memory."""
    assert not [how for how in own_deck_fuzz.sizes() if how not in ("refused", "read")]
