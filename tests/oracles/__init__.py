"""Solvers that share no line with the package: what the package says is judged by them."""
