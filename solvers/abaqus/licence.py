"""Distinguishes a denied licence from every other way in which a job ends badly."""

from __future__ import annotations

import re

# Only looked for when a job did not complete: a healthy log names the licence manager too
# ("Abaqus License Manager checked out the following licenses: ... from Flexnet server ...").
_LICENCE = r"licen[sc]\w*"
_DENIED = r"(?:denied|unavailable|not available|fail\w*|unable|could not|cannot|can't|exceed\w*)"
PATTERNS = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"{_LICENCE}[^\n]*\b{_DENIED}",  # the manager's own sentence, either way round
        rf"\b{_DENIED}\b[^\n]*{_LICENCE}",
        rf"\bno\b[^\n]*\b{_LICENCE}\b[^\n]*available",
        r"\b(?:cannot|could not|unable to) check\s?out",  # of tokens, "license" unsaid
        r"flex(?:net|lm)\b[^\n]*\berror",  # FLEXnet's error header; "error -5,357" follows
        r"licensed number of users already reached",  # FLEXnet error -4
        r"insufficient tokens",
    )
)

# Printed while ABAQUS itself queues: it only means something as the last that was said.
QUEUEING = re.compile(rf"\b(?:waiting|queue\w*)\b.*{_LICENCE}|{_LICENCE}.*queue", re.IGNORECASE)


def denial(text: str) -> str:
    """The first line of ``text`` that reports a denied licence; empty where there is none."""
    for line in text.splitlines():
        if any(pattern.search(line) for pattern in PATTERNS):
            return line.strip()
    return ""


def is_queueing(last_words: str) -> bool:
    """Whether a job whose last line this is was still waiting for its licence."""
    return bool(QUEUEING.search(last_words) or denial(last_words))
