"""Decks and scripts that run elsewhere and judge themselves; checks of other decks."""
