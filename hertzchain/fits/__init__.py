"""Fits of a scene to measured forces over time."""
