"""Somebody's own LAMMPS deck against a scene: what differs, what it costs, which line makes it."""

from hertzchain.verdict.deck.deck_check import DeckCheck
from hertzchain.verdict.deck.examined import DeckExamination
from hertzchain.verdict.deck.examining import compared, examine

__all__ = ["DeckCheck", "DeckExamination", "compared", "examine"]
