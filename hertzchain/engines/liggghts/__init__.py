"""LIGGGHTS, a further oracle: a deck of the same scene, run by its program."""

from hertzchain.engines.liggghts.backend import Liggghts

__all__ = ["Liggghts"]
