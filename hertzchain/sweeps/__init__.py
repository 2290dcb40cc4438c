"""Sweeps: what becomes of peaks and p where pulse, material and chain change.

keys        what can vary in a scene, by the keys of its file
design      which scenes there are
natural     similarity, of many scenes at once
parts       who measures, and how a sweep is cut
table       the rows, filled in as scenes are done
measuring   a part, measured
local       parts on this machine
cluster     parts on the workers of a Dask scheduler
on_worker   what runs there
store       in memory, or in a folder
sweeping    all of that: sweep, Sweep
drawing     a sweep as a picture
"""

from hertzchain.sweeps.sweeping import Counts, Sweep, sweep

__all__ = ["Counts", "Sweep", "sweep"]
