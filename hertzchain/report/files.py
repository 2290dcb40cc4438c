"""Files of results: peaks, motion, traces and trajectories, and the times that they have."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.errors import OutputError, SceneError
from hertzchain.files import write_text, write_with
from hertzchain.observables.result import Result
from hertzchain.observables.samples import History
from hertzchain.theory.restitution import parting

if TYPE_CHECKING:
    import pandas
    from ase import Atoms


Tabular = Any
"""A result, or a spread: it has ``to_dict`` and ``to_frame``."""


def recorded(result: Result) -> History:
    """Return the history of a run; a SceneError if nothing was recorded."""
    if result.history is None:
        raise SceneError("history", None, "there is none: run with record = the times to keep")
    return result.history


_FORMATS = {
    "plot": ("cannot be drawn, the name", (".pdf", ".png", ".svg")),
    "page": ("a report is a page, the name", (".html", ".htm")),
    "trajectory": ("a trajectory's name", (".xyz", ".extxyz")),
    "motion": ("with --record the motion is written, the name", (".csv", ".parquet")),
    "traces": ("traces are a table, the name", (".csv", ".parquet")),
    "result": ("cannot be written, the name", (".csv", ".json", ".parquet")),
}
"""Words on each kind of file, and the suffixes of its formats."""


def check_format(path: Path | str | None, kind: str) -> None:
    """Raise an OutputError if a file is wanted whose suffix is not a format of its kind."""
    words, suffixes = _FORMATS[kind]
    suffix = "" if path is None else Path(path).suffix.lower()
    is_pipe = kind == "result" and not suffix  # pipes and devices have none
    if path is None or is_pipe:
        return
    if suffix not in suffixes:
        listed = (" or " if kind in ("page", "trajectory") else ", ").join(suffixes)
        raise OutputError(f"{path}: {words} must end in {listed}")


def run_document(result: Tabular, pulses: bool = False) -> dict[str, Any]:
    """Return the JSON document of a run: the result, and how two spheres part under its damping.

    With ``pulses`` it has those of all contacts.
    """
    document: dict[str, Any] = result.to_dict(pulses) if pulses else result.to_dict()
    spheres = parting(result.scene) if isinstance(result, Result) else None
    if spheres is None:
        return document
    of_spheres = {"restitution": spheres.restitution, "speed_m_s": spheres.speed}
    return {**document, "two_spheres": of_spheres}


def write_result(result: Tabular, path: Path | str, pulses: bool = False) -> None:
    """Write a result, completely or not at all; OutputError on failure.

    ``.csv`` and ``.parquet`` have a row for each contact, as ``Result.to_frame``; ``.json`` has the
    whole result, as ``Result.to_dict``. A spread has the same functions. With ``pulses`` the rows
    are those of ``Result.pulses``, which the whole result then has, too.
    """
    check_format(path, "result")
    if Path(path).suffix.lower() == ".json":
        write_text(path, json.dumps(run_document(result, pulses), indent=2, allow_nan=False) + "\n")
    else:
        write_frame(result.pulses() if pulses else result.to_frame(), Path(path))


def write_frame(frame: pandas.DataFrame, path: Path) -> None:
    """Write a table as Parquet or, for any other name or a pipe, as CSV."""
    if path.suffix.lower() == ".parquet":
        write_with(path, lambda part: frame.to_parquet(part, engine="pyarrow", index=False))
    else:
        write_text(path, frame.to_csv(index=False))


def motion_frame(result: Result) -> pandas.DataFrame:
    """Recorded motion as a table with a row for each time and granule, time by time.

    Its columns are ``time_s``, ``granule``, ``displacement_m``, ``velocity_m_s`` and
    ``contact_force_N``. The contact of granule i is contact i, between granules i - 1 and i;
    granule 1 has the applied force, or that of a near wall. A wall is one more granule, which does
    not move. ``frame.pivot(index="time_s", columns="granule", values="contact_force_N")`` makes a
    column for each granule.
    """
    import pandas

    history = recorded(result)
    applied = result.scene.applied_force(history.time)
    displacement, velocity = history.displacement, history.velocity
    behind = [] if result.scene.near_wall is not None else [applied]
    force = np.column_stack([*behind, history.contact_force])
    if result.scene.wall is not None:
        still = np.zeros(history.time.size)
        displacement = np.column_stack([displacement, still])
        velocity = np.column_stack([velocity, still])
    times, granules = force.shape
    return pandas.DataFrame(
        {
            "time_s": np.repeat(history.time, granules),
            "granule": np.tile(np.arange(1, granules + 1), times),
            "displacement_m": displacement.ravel(),
            "velocity_m_s": velocity.ravel(),
            "contact_force_N": force.ravel(),
        }
    )


def write_trajectory(result: Result, path: Path | str) -> None:
    """Write the history of a run as extended XYZ, completely or not at all.

    One frame for each recorded time, one line for each granule, in these columns:

    ``species``
        X for each granule, which is not a chemical element.
    ``pos``, ``displacement``
        Position of its centre, and displacement from the position at rest.
    ``radius``
        Radius in which viewers draw it.
    ``velocity``
        Velocity of its centre.
    ``contact_force``
        Force in contact i, between granules i - 1 and i, for granule i; for the first granule the
        applied force, F_1 in the paper.
    ``id``
        The paper's number of the granule, from 1.
    ``velo``
        Velocity again, by the name in OVITO.

    ASE writes numbers with eight digits after the point. In metres that would leave two digits of a
    displacement of 1e-6 m, so lengths are in a unit that is a power of 1000 times the metre, at
    most as long as the natural unit of length, which is the overlap under F0; likewise velocities
    and forces. So rounding is at most 5e-9 of the natural units. Each frame has the values of its
    units, ``length_unit_m``, ``velocity_unit_m_s`` and ``force_unit_N``, which are not those of ASE
    (angstrom, eV), and its time, ``time_s``.

    The cell, ``Lattice`` with its corner at ``Origin``, just holds the chain at rest. It is not
    periodic, and granules may leave it.

    Parameters
    ----------
    result
        Result of a run with ``record``.
    path
        File to write; its name must end in .xyz or .extxyz.

    Raises
    ------
    SceneError
        If nothing was recorded.
    OutputError
        If the file cannot be written.
    """
    from ase.io.extxyz import write_xyz

    check_format(path, "trajectory")
    if result.history is None:
        raise SceneError(
            "history", None, "there is none: run with record = a number of frames, or times"
        )
    # Frames have no results, and without these ASE does not copy each frame: its copies set the
    # shape of an array, for which NumPy warns from 2.5 on.
    write_with(path, lambda part: write_xyz(part, frames(result), write_results=False))


def frames(result: Result) -> Iterator[Atoms]:
    """Yield the history of a run as frames of ASE, in the units of ``write_trajectory``."""
    from ase import Atoms

    scene, history = result.scene, result.history
    assert history is not None
    count, granules, first = scene.chain.granules, scene.granules, scene.first_granule
    length, velocity, force = (
        power_of_1000(unit)
        for unit in (scene.units.length, scene.units.velocity, scene.units.force)
    )
    radius, widest = granules.radius[first:] / length, 2 * float(np.max(granules.radius)) / length
    sites = granules.position[first:] - granules.position[first]
    span = sites[-1] / length + radius[-1] + radius[0]
    applied = scene.applied_force(history.time)
    for k, time in enumerate(history.time.tolist()):
        frame = Atoms(
            numbers=np.zeros(count, int),
            positions=_along_x((sites + history.displacement[k]) / length),
            cell=[span, widest, widest],
            pbc=False,
            info={
                "Origin": np.array([-radius[0], -widest / 2, -widest / 2]),
                "time_s": time,
                "length_unit_m": length,
                "velocity_unit_m_s": velocity,
                "force_unit_N": force,
            },
        )
        moving = _along_x(history.velocity[k] / velocity)
        behind = applied[k : k + 1 - first]  # where no near wall is
        pressed = np.concatenate([behind, history.contact_force[k]]) / force
        frame.set_array("radius", radius)
        frame.set_array("displacement", _along_x(history.displacement[k] / length))
        frame.set_array("velocity", moving)
        frame.set_array("contact_force", pressed[:count])
        frame.set_array("id", np.arange(1, count + 1))
        frame.set_array("velo", moving)
        yield frame


def power_of_1000(value: float) -> float:
    """Return the largest power of 1000 that is at most a value."""
    return float(f"1e{3 * math.floor(math.log10(value) / 3)}")


def _along_x(values: FloatArray) -> FloatArray:
    vectors = np.zeros((values.size, 3))
    vectors[:, 0] = values
    return vectors
