"""Measured forces over time: read, laid over those of a scene, and judged."""
