"""The three ways to give a tyre: stations, a section deck, decks in three dimensions."""
