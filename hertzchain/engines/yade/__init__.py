"""Yade, a further oracle: a script of the same scene, run by its program."""
