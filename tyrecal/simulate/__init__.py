"""Behaviour of a design: decks, evaluator, record, workers, labelled modes."""
