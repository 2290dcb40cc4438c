"""Sweeps: peaks and p of many scenes with different pulses, materials and chains.

keys        parameters of a scene that can vary, by the keys of its file
design      the scenes of a sweep
table       the rows, filled in as scenes are done
similarity  natural units of many uniform chains
loop        one loop over parts, on this machine or the workers of a Dask scheduler
folder      parts in a folder or in memory
sweeping    the functions for users: sweep, Sweep
drawing     a sweep as a picture
points      Sobol points
"""
