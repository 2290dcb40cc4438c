"""Reads the arrays of a running LAMMPS, in SI units."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.readings import Granules
from hertzchain.engines.lammps.dialect import NO_STEP, WALL

ARRAYS = ("x", "v", "f")  # positions [m], velocities [m/s], net forces [N]; three components each

COMMANDS = f"atom_modify sort 0 0\nthermo_style custom step\ntimer off\n{NO_STEP}\n"
"""Commands for reading: granules in the order of their ids, and stops that cost little."""

_PER_ATOM, _ARRAY = 1, 2  # LMP_STYLE_ATOM and LMP_TYPE_ARRAY of the lammps module
_DOUBLE_2D = 3  # LAMMPS_DOUBLE_2D of the lammps module, which is imported only when needed


def read(instance: Any, into: FloatArray) -> None:
    """Copy the present state of LAMMPS, on one process, to (array, granule, component), contiguous.

    Granules are in the order of their ids. LAMMPS may move its arrays during a run, so their
    addresses are read each time.
    """
    target, size = into.ctypes.data, into[0].nbytes
    for name in ARRAYS:
        ctypes.memmove(target, instance.extract_atom(name, _DOUBLE_2D)[0], size)
        target += size


def wall_force(instance: Any) -> float:
    """Return the present force of the last granule on the wall [N], on one process."""
    forces = instance.extract_fix(WALL, _PER_ATOM, _ARRAY)
    return -float(forces[instance.extract_setting("nlocal") - 1][1])


def granules(instance: Any) -> Granules:
    """Return the present granules of LAMMPS, with its masses computed from diameter and density."""
    arrays = instance.numpy
    return Granules(
        np.array(arrays.extract_atom("x")[:, 0], dtype=np.float64),
        np.array(arrays.extract_atom("rmass"), dtype=np.float64),
        2 * np.array(arrays.extract_atom("radius"), dtype=np.float64),
    )
