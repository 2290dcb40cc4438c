"""Sweeps: peaks and p of many scenes with different pulses, materials and chains.

columns     keys of a scene that can vary and numbers of results, by their names
design      the scenes of a sweep
loop        one loop over parts, on this machine or the workers of a Dask scheduler, and its table
sweeping    the functions for users, and parts in a folder or in memory: sweep, Sweep
drawing     a sweep as a picture
"""
