"""Sweeps: peaks and p of many scenes with different pulses, materials and chains.

keys        parameters of a scene that can vary, by the keys of its file
design      the scenes of a sweep
parts       backends, and the parts that a sweep is cut into
table       the rows, filled in as scenes are done
measuring   measures a part
running     one loop over parts, and this machine
cluster     parts on the workers of a Dask scheduler
store       sweeps in memory or in a folder
sweeping    the functions for users: sweep, Sweep
drawing     a sweep as a picture
"""

from hertzchain.sweeps.sweeping import Counts, Sweep, sweep

__all__ = ["Counts", "Sweep", "sweep"]
