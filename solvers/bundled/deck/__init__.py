"""The decks: ABAQUS keywords, their grammar, the steps, and what a request adds to them."""
