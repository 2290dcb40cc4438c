"""Observables of a run, the same for every backend: peaks, work, histories, error, result."""
