"""The table of keywords: one record each, which all readers and checks go by."""

from __future__ import annotations

from .model_rules import MODEL_RULES
from .other_keywords import OTHER_KEYWORDS
from .rule import read_rules
from .step_rules import STEP_RULES

RULES = read_rules(MODEL_RULES + STEP_RULES + OTHER_KEYWORDS)
OUTPUT_KEYWORDS = frozenset(name for name, rule in RULES.items() if rule.is_output)
CONTACT_KEYWORDS = frozenset(name for name, rule in RULES.items() if rule.is_contact)
MATERIAL_OPTIONS = frozenset(
    name
    for name, rule in RULES.items()
    if rule.under == ("MATERIAL",) and "deck" in rule.options_at
)
