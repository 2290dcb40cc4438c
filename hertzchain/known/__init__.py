"""Scenes with an expected answer: decks that judge themselves, unit tests, certificates."""
