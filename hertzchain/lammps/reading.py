"""Reading a running LAMMPS: its arrays, as samples in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.samples import Samples


@dataclass(frozen=True)
class Snapshot:
    """The arrays of LAMMPS at one time, along the chain.

    Parameters
    ----------
    time
        [s].
    position, velocity, force
        x [m], vx [m/s] and the net force fx [N], shape (granules,).
    """

    time: float
    position: FloatArray
    velocity: FloatArray
    force: FloatArray


def snapshot(instance: Any, time: float) -> Snapshot:
    """Copy what LAMMPS holds now; its order is that of the ids."""
    atoms = instance.numpy
    return Snapshot(
        time,
        atoms.extract_atom("x")[:, 0].copy(),
        atoms.extract_atom("v")[:, 0].copy(),
        atoms.extract_atom("f")[:, 0].copy(),
    )


def masses(instance: Any) -> FloatArray:
    """The masses that LAMMPS made from diameter and density [kg], shape (granules,)."""
    return np.array(instance.numpy.extract_atom("rmass"), dtype=np.float64)


def diameters(instance: Any) -> FloatArray:
    """The diameters that LAMMPS holds [m], shape (granules,)."""
    return 2 * np.array(instance.numpy.extract_atom("radius"), dtype=np.float64)


def contact_forces(net_force: FloatArray) -> FloatArray:
    """Force in each contact from the net forces on the granules [N].

    Nothing pushes the granules beyond a contact but that contact, so its force is the sum of the
    net forces there. Summed from the free end, where forces are small, nothing is lost.

    Parameters
    ----------
    net_force
        Shape (..., granules).

    Returns
    -------
    Shape (..., granules - 1).
    """
    return np.cumsum(net_force[..., :0:-1], axis=-1)[..., ::-1]


def samples(
    snapshots: list[Snapshot], start: FloatArray, mass: FloatArray, diameter: FloatArray
) -> Samples:
    """Successive snapshots as samples.

    Parameters
    ----------
    snapshots
        At least two, of one leg.
    start
        Positions before the shock [m], shape (granules,).
    mass, diameter
        Of each granule [kg], [m], shape (granules,).
    """
    position = np.array([shot.position for shot in snapshots])
    force = np.array([shot.force for shot in snapshots])
    reach = (diameter[:-1] + diameter[1:]) / 2
    overlap = reach - np.diff(position, axis=-1)
    # Granules that only touch overlap by the rounding of their positions: that is no contact.
    pressed = overlap > np.finfo(np.float64).eps * np.max(np.abs(start))
    return Samples(
        time=np.array([shot.time for shot in snapshots]),
        displacement=position - start,
        velocity=np.array([shot.velocity for shot in snapshots]),
        acceleration=force / mass,
        overlap=overlap,
        contact_force=np.where(pressed, contact_forces(force), 0.0),
    )
