"""The table of keywords: one record each, of the model and of steps."""

from __future__ import annotations

from .model_rules import MODEL_RULES
from .rule import Rule
from .step_rules import STEP_RULES

RULES: dict[str, Rule] = {**MODEL_RULES, **STEP_RULES}
