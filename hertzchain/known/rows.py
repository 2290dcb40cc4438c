"""The scenes of a certificate: one for each thing that can be wrong in a build of LAMMPS.

Most are driven by a moving first granule, so that a wrong force over time shows only in the rows
that test it.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from hertzchain.engines.native.backend import Native
from hertzchain.observables.result import Result
from hertzchain.scene.chain import Chain
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Run
from hertzchain.scene.shocks import Piston, Pulse, Striker
from hertzchain.scene.terms import Contact, Precompression, Wall

STEP = 0.02  # steps of all runs [natural time units]; chosen
_UNITS_AFTER = 24.0  # end of a run [natural time units], when the wave has passed 12 granules twice
_STEEL: dict[str, float] = {
    "radius": 4.75e-3, "young_modulus": 193e9, "poisson_ratio": 0.3, "density": 7958.0,
}  # fmt: skip
_ALUMINIUM = {"radius": 6e-3, "young_modulus": 69e9, "poisson_ratio": 0.33, "density": 2700.0}
_CGS = {
    "radius": 1e2, "young_modulus": 10.0, "density": 1e-3, "velocity": 1e2, "gravity": 1e2,
    "force": 1e5, "peak_force": 1e5,
}  # fmt: skip
"""A unit of SI in units of cgs: centimetres, grams and dyn."""


@dataclass(frozen=True)
class Case:
    """A scene that tests one thing."""

    name: str  # of the row
    tests: str  # what is wrong if the row fails
    scene: Scene  # in the row of cgs its numbers are in cgs units
    style: str = "granular"  # what the row tests: it must have run with a suffix that was asked for
    pair_style: str = "granular"
    # the deck that is run, from that of the scene and the number of ranks
    edit: Callable[[str, int], str] = lambda text, _: text
    needs_ranks: bool = False  # whether the row tests nothing on one rank
    of_lammps: bool = False  # whether LIGGGHTS and Yade have no such feature

    @property
    def file(self) -> str:
        """The name in names of files."""
        return re.sub(r"\W+", "_", self.name)

    @property
    def dt(self) -> float:
        """The largest step [s]."""
        return STEP * self.scene.contact_time


@functools.cache
def expected(name: str) -> Result:
    """Return the result of native velocity Verlet for a case, at the steps of the deck."""
    case = CASES[name]
    return Native("velocity-verlet", case.dt, wanted="all").run(case.scene)


_LIKE = Chain(12, **_STEEL)
_UNLIKE = Chain(12, **{key: [of_steel, _ALUMINIUM[key]] * 6 for key, of_steel in _STEEL.items()})
"""Chains of steel, and with aluminium at every other place."""


def _ended(scene: Scene, units: float = _UNITS_AFTER) -> Scene:
    return replace(scene, run=Run(units * scene.contact_time))


def _struck(chain: Chain = _LIKE, after: float = _UNITS_AFTER, **terms: Any) -> Scene:
    return _ended(Scene(chain, terms.pop("striker", Striker(1.0)), **terms), after)


def _pushed(profile: Any = "cosine") -> Scene:
    return _ended(Scene(_LIKE, Pulse(profile, 100.0, 2.0, momentum_ratio=1.0)))


def _at_wall(wall: Wall, contact: Contact | None = None) -> Scene:
    return _struck(replace(_LIKE, granules=4), wall=wall, contact=contact)


def _damped(damping: Any, **law: Any) -> Scene:
    return _struck(_UNLIKE, contact=Contact(damping, **law))


def _restarted(text: str, ranks: int) -> str:
    """Return a deck that stops after the pulse and continues from a restart file.

    The pair style is stated again: LAMMPS of 2022 to 2025 restores granular with a cutoff of 0, so
    that no rank would have granules of its neighbours.
    """
    law = text[text.index("pair_style") : text.index("# Wide enough")]
    commands = [
        "unfix shock", "write_restart middle.restart", "clear", f"processors {ranks} 1 1",
        "comm_modify vel yes", "read_restart middle.restart", law, "fix motion all nve",
        "thermo_style custom step",
    ]  # fmt: skip
    return text.replace("unfix shock", "\n".join(commands))


def _in_cgs(scene: Scene) -> Scene:
    """Return a scene with the numbers of another in units of cgs."""

    def scaled(part: Any) -> Any:
        numbers = {key: getattr(part, key, None) for key in _CGS}
        cgs = {key: by * _CGS[key] for key, by in numbers.items() if isinstance(by, float)}
        return replace(part, **cgs)

    return _ended(replace(scene, chain=scaled(scene.chain), shock=scaled(scene.shock)))


_TABLE = (
    Case("like granules", "Hertz's law, E* and R* of equal granules", _struck()),
    Case("unlike granules", "E*, R* and masses of pairs of two materials", _struck(_UNLIKE)),
    Case(
        "gaps", "contacts that begin with a gap and open again", _struck(replace(_LIKE, gap=2e-6))
    ),
    Case(
        "gran/hertz/history", "Hertz's law of the older pair style", _pushed(),
        "gran/hertz/history", "gran/hertz/history", of_lammps=True,
    ),
    Case("rigid wall", "fix wall/gran, a flat rigid wall", _at_wall(Wall("rigid")), "wall/gran"),
    Case(
        "elastic wall", "fix wall/gran, a wall of another material",
        _at_wall(Wall("elastic", 70e9, 0.33)), "wall/gran",
    ),
    Case(
        "damping, restitution", "damping coeff_restitution (before August 2024: tsuji)",
        _damped("restitution", restitution=0.6),
    ),
    Case(
        "damping, viscoelastic", "damping viscoelastic",
        _damped("viscoelastic", relaxation_time=4e-6),
    ),
    Case("damping, dashpot", "damping velocity", _damped("dashpot", coefficient=50.0)),
    Case(
        "damping that pulls", "damping without limit_damping",
        _damped("restitution", restitution=0.6, attraction=True),
    ),
    Case(
        "damped wall", "fix wall/gran with damping",
        _at_wall(Wall("rigid"), Contact("viscoelastic", relaxation_time=4e-6)), "wall/gran",
    ),
    Case(
        "force over time", "fix addforce with a formula of the time, from corner to corner",
        _pushed("cosine-triangular"), "addforce",
    ),
    Case(
        "striker", "a first granule of its own size and velocity",
        _struck(striker=Striker(1.0, radius=8e-3)), "nve",
    ),
    Case("piston", "fix move", _ended(Scene(_LIKE, Piston(velocity=1.0))), "move"),
    Case(
        "static load", "constant forces at both ends, balanced by overlaps",
        _struck(striker=Striker(1.0, loaded=True), precompression=Precompression(100.0)),
        "addforce",
    ),
    Case(
        "gravity", "fix gravity, balanced by a wall",
        _struck(
            striker=Striker(1.0, loaded=True), wall=Wall("same"),
            precompression=Precompression(gravity=1e4),
        ),
        "gravity",
    ),
    Case(
        "granules over ranks", "contacts of granules of two ranks",
        _struck(replace(_LIKE, granules=40), 45.0), "nve", needs_ranks=True, of_lammps=True,
    ),
    Case(
        "restart in the middle", "write_restart, clear, read_restart", _pushed(), "nve",
        edit=_restarted, of_lammps=True,
    ),
    Case(
        "units cgs", "the same in centimetres, grams and dyn", _in_cgs(_struck()),
        edit=lambda text, _: text.replace("units si", "units cgs"),
    ),
)  # fmt: skip

CASES = {case.name: case for case in _TABLE}
"""All cases, in the order of the table."""
