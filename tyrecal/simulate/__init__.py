"""What a design does: decks, evaluator, record, workers, labelled modes."""
