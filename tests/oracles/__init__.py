"""Solvers that share no line with the package, and judge its results."""
