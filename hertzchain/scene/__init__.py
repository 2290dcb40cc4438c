"""Scenes: chain, shock, run, and the steps into which every engine cuts a run."""
