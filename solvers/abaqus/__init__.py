"""Runs ABAQUS on the pair of decks and reads its ASCII results. No ABAQUS was at hand: what the
results look like follows its published format, and what only a run could show is unconfirmed."""
