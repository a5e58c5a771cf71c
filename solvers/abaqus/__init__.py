"""Runs ABAQUS on the pair of decks and reads its ASCII results. No ABAQUS was available: the form
of the results follows its published format, and what only a run could show is unconfirmed."""
