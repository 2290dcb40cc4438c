"""Verdicts: checks of results, comparisons of codes, and causes of wrong peaks."""
