"""Decks and scripts for use elsewhere, which judge themselves, and what is wrong with others."""
