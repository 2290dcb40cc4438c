"""A user's LAMMPS deck against a scene: differences, their effects on peaks, their lines."""

from hertzchain.verdict.deck.deck_check import DeckCheck
from hertzchain.verdict.deck.examined import DeckExamination
from hertzchain.verdict.deck.examining import compared, examine

__all__ = ["DeckCheck", "DeckExamination", "compared", "examine"]
