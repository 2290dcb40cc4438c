"""Sweeps: peaks and p of many scenes with different pulses, materials and chains.

columns     parameters and numbers of results, by their names
keys        parameters of a scene that can vary, by the keys of its file
design      the scenes of a sweep
loop        one loop over parts, on this machine or the workers of a Dask scheduler, and its table
folder      parts in a folder or in memory
sweeping    the functions for users: sweep, Sweep
drawing     a sweep as a picture
"""
