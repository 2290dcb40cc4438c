"""Yade, a further oracle: a script of the same scene, run by its program."""

from hertzchain.engines.yade.backend import Yade

__all__ = ["Yade"]
