"""LIGGGHTS, a further oracle: a deck of the same scene, run by its program."""
