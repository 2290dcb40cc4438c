"""The LIGGGHTS backend: scene to deck, the program, and its result."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import ClassVar

import numpy as np

from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.external.observation import Granules, Observation, read_frames
from hertzchain.engines.external.terms import (
    LET_GO_PISTON,
    OF_OTHER_CODES,
    force_on_ramp,
    load_commands,
    materials_of,
    motion_commands,
    positions,
    push_command,
    refuse_long,
    stroke_commands,
    wall_material,
    wall_position,
    weighty_density,
)
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

# files with the granules before the shock, and with all readings
AT_REST, READINGS = "at_rest.dump", "readings.dump"

# columns of the readings: positions [m], velocities [m/s] and net forces [N]
COLUMNS = ("x", "vx", "fx")
_WALL_FORCE = "f_force_wall"  # of the wall on each granule, by its option store_force
GRANULES = ("x", "mass", "diameter")  # columns of the granules at rest: [m], [kg], [m]


START = (
    "units si",
    "atom_style granular",
    "atom_modify map array",
    "# The box follows the chain along x; nothing is periodic, so there are no ghosts.",
    "boundary s f f",
    "newton off",
    "communicate single vel yes",
    "# Any Young's modulus: without these it must be between 5e6 and 1e9 Pa.",
    "hard_particles yes",
    "soft_particles yes",
)


def set_up(scene: Scene) -> str:
    """Return the commands that create the chain, ready to run; RunFailed if they are too many."""
    refuse_long("a LIGGGHTS deck of", scene)
    materials, kinds = materials_of("LIGGGHTS", scene.granules)
    if scene.wall is not None:
        materials = [*materials, wall_material(scene)]
    count, contact = len(materials), scene.contact
    moduli, ratios = (" ".join(map(repr, column)) for column in zip(*materials, strict=True))
    pairs = "property/global coefficientRestitution peratomtypepair"
    row = "    " + " ".join([repr(1.0 if contact is None else contact.parameter)] * count)
    limit = "" if contact is None or contact.attraction else " limitForce on"
    damping = (
        "without damping (coefficient of restitution 1)" if contact is None else "with damping"
    )
    lines = [
        *START,
        "",
        *_granules(scene, kinds, count),
        "# Wide enough for the nearest neighbours, too narrow for the next; looked at every step.",
        f"neighbor {float(np.min(scene.granules.radius)) / 2!r} bin",
        "neigh_modify delay 0",
        "",
        f"# Hertz's law {damping} and tangential force.",
        f"fix youngsModulus all property/global youngsModulus peratomtype {moduli}",
        f"fix poissonsRatio all property/global poissonsRatio peratomtype {ratios}",
        f"fix coefficientRestitution all {pairs} {count} &",
        " &\n".join([row] * count),
        f"pair_style gran model hertz tangential off{limit}",
        "pair_coeff * *",
        "",
        *motion_commands(scene),
        "thermo 1000000000",
        f"group last id {scene.chain.granules}",
    ]
    if scene.wall is not None:
        lines += [
            "fix wall all wall/gran model hertz tangential off store_force yes &",
            f"    primitive type {count} xplane {wall_position(scene)!r}{limit}",
        ]
    return "\n".join([*lines, *load_commands(scene)]) + "\n"


def _granules(scene: Scene, kinds: list[int], types: int) -> list[str]:
    """Return the commands for each granule at its start position: touching, apart or pressed."""
    position, radius = positions(scene), scene.granules.radius.tolist()
    low, high, widest = position[0] - radius[0], position[-1] + radius[-1], max(radius)
    across = f"{-widest!r} {widest!r}"
    spheres = list(zip(radius, weighty_density(scene.granules).tolist(), strict=True))
    alike = len(set(spheres)) == 1
    named = (
        {"group all": spheres[0]}
        if alike
        else {f"atom {number}": sphere for number, sphere in enumerate(spheres, start=1)}
    )
    return [
        f"region chain block {low!r} {high!r} {across} {across} units box",
        f"create_box {types} chain",
        "# One by one; granule 1 is at x = 0, where coordinates have most digits.",
        *(
            f"create_atoms {kind} single {place!r} 0.0 0.0 units box"
            for kind, place in zip(kinds, position, strict=True)
        ),
        *(
            f"set {those} diameter {2 * sphere_radius!r} density {heavy!r}    # m, kg/m^3"
            for those, (sphere_radius, heavy) in named.items()
        ),
    ]


def leg_commands(scene: Scene, leg: Leg, before: Leg | None) -> list[str]:
    """Return the commands between two legs: the new step and the new force."""
    lines = [] if before is None or before.stroke is None else [LET_GO_PISTON]
    # Back to step 0, so that readings are counted from the start of each leg.
    lines += [] if before is None else ["reset_timestep 0"]
    lines += [f"timestep {leg.dt!r}"]
    if leg.stroke is not None:
        return [*lines, *stroke_commands(leg.stroke)]
    if before is not None and before.ramp is not None:
        lines.append("unfix shock")
    if leg.ramp is not None:
        lines.append(f"variable force equal {force_formula(leg)}")
        lines.append(push_command(scene))
    return lines


def force_formula(leg: Leg) -> str:
    """Return the force on a leg as a LIGGGHTS formula of ``elapsed``, the number of steps on it.

    LIGGGHTS has no formula for the time. A leg starts where its ramp starts.
    """
    ramp = leg.ramp
    assert ramp is not None
    assert ramp.start == leg.start
    return force_on_ramp(ramp, f"elapsed*{leg.dt / (ramp.end - ramp.start)!r}")


def columns_of(scene: Scene) -> tuple[str, ...]:
    """Return the columns of the readings: ``COLUMNS``, and the negative force of a wall."""
    return COLUMNS if scene.wall is None else (*COLUMNS, f"{_WALL_FORCE}[1]")


def watched(scene: Scene, legs: Sequence[Leg], strides: Sequence[int]) -> str:
    """Return a deck that writes the granules at rest, and readings at intervals of steps."""
    columns = columns_of(scene)
    lines = [set_up(scene), *_dump("rest", 1, AT_REST, GRANULES), "run 0", "undump rest"]
    for before, leg, stride in zip((None, *legs[:-1]), legs, strides, strict=True):
        lines += [
            *leg_commands(scene, leg, before),
            *_dump("readings", stride, READINGS, columns),
            f"run {leg.steps}",
            "undump readings",
        ]
        if leg.steps % stride:
            kept = f"modify append yes sort id {_digits(columns)}"
            lines.append(f"write_dump all custom {READINGS} id {' '.join(columns)} {kept}")
    return "\n".join(lines) + "\n"


def _dump(name: str, stride: int, file: str, columns: Sequence[str]) -> list[str]:
    return [
        f"dump {name} all custom {stride} {file} id {' '.join(columns)}",
        f"dump_modify {name} append yes first yes sort id {_digits(columns)}",
    ]


def _digits(columns: Sequence[str]) -> str:
    """Return formats with all digits of every number."""
    return f'format "%d{" %.17g" * len(columns)}"'


def deck(scene: Scene, legs: Sequence[Leg], about: Sequence[str]) -> str:
    """Return a deck for ``liggghts -in FILE`` that writes peaks.csv, below the lines ``about``."""
    # Of a contact force, natural time units: costs about 5e-6
    interval = max(1, int(0.005 * scene.units.time / max(leg.dt for leg in legs)))
    contacts = range(2, scene.chain.granules + 1)
    lines = [
        *(f"# {line}" for line in about),
        "# Run it with: liggghts -in THIS_FILE",
        "",
        set_up(scene),
        *_sample_peaks(scene, contacts, interval),
        "",
    ]
    for before, leg in zip((None, *legs[:-1]), legs, strict=True):
        until = "the force follows a ramp" if leg.ramp else "no force"
        until = "the piston moves" if leg.stroke else until
        lines += [
            f"# {leg.start:.6g} s to {leg.end:.6g} s: {until}",
            *leg_commands(scene, leg, before),
            *([NO_FORCE] if scene.pushed and leg.ramp is None else []),
            f"run {leg.steps}",
            "",
        ]
    lines += [
        'print "contact,peak_force_N" file peaks.csv',
        *(f'print "{contact},$(v_largest[{contact}])" append peaks.csv' for contact in contacts),
        *([] if scene.wall is None else [_WALL_PEAK.format(scene.last_contact, contacts[-1])]),
    ]
    return "\n".join(lines) + "\n"


NO_FORCE = "variable force equal 0.0"
"""Command that gives the variable of the applied force a value where no force acts."""

_WALL_PEAK = 'print "{},$(v_largest_wall[{}])" append peaks.csv'


def _sample_peaks(scene: Scene, contacts: Sequence[int], interval: int) -> list[str]:
    """Return the commands that keep the largest force of each contact, from samples.

    Samples are ``interval`` steps apart, and up to twice as many where a leg begins, because each
    leg counts steps from 0.
    """
    fx, pressed, last = [f"(id<={k})*fx[{k}]" for k in contacts], scene.precompression, contacts[-1]
    outside = [] if scene.wall is None else [f"(0-{_WALL_FORCE}[{last}][1])"]
    if pressed is not None and pressed.gravity:
        outside += [f"(id<={k})*mass[{k}]*(0-{pressed.gravity!r})" for k in contacts]
    if pressed is not None and (loaded := scene.shock.loaded_granule):
        outside.append(f"(id<={loaded + 1})*(0-{pressed.force!r})")
    if scene.held_load:
        outside.append(repr(scene.held_load))
    if scene.pushed:
        outside.append(f"(id<={scene.pushed + 1})*(0-v_force)")
    forces = {"": " + ".join([*fx, *outside])}
    if scene.wall is not None:
        forces["_wall"] = f"(0-{_WALL_FORCE}[1])"

    def larger(new: str, old: str) -> str:
        return f"{new}*({new}>{old}) + {old}*({new}<={old})"

    return [
        "# The force in a contact is the sum of fx over all granules beyond it. Each granule keeps",
        f"# the largest force of the contact before it, of samples {interval} steps apart.",
        *(["# Forces that are not those of contacts are taken off the sum."] if outside else []),
        *([NO_FORCE] if scene.pushed else []),
        *(
            line
            for of, force in forces.items()
            for line in (
                f'variable contact{of} atom "{force}"',
                f'variable peak{of} atom "{larger(f"f_contact{of}", f"f_peak{of}")}"',
            )
        ),
        "run 0  # without a run before it fix store/state crashes",
        *(
            f"fix {what}{of} all store/state {interval} v_{what}{of}"
            for of in forces
            for what in ("contact", "peak")
        ),
        "# With the force at the end of the run.",
        *(
            f'variable largest{of} atom "{larger(f"v_contact{of}", f"f_peak{of}")}"'
            for of in forces
        ),
    ]


_LOG = "log.liggghts"

_LEAST_RESTITUTION = 0.05
"""Restitution above which LIGGGHTS accepts values."""


@dataclass(frozen=True)
class Liggghts(ProgramEngine):
    """A generated deck, run by the program ``liggghts``, a fork of LAMMPS.

    Each run starts the program, which takes half a second. It accepts Poisson's ratios from 0 to
    0.5; contacts are elastic or have a restitution above 0.05.

    Parameters
    ----------
    program
        Path of the program, or its name on the search path.
    dt, read_every, rtol, extrapolated, time_limit, wanted
        As for ``Lammps``; impossible ones raise a SceneError.
    """

    LABEL: ClassVar[str] = "LIGGGHTS"
    FILE: ClassVar[str] = "in.chain"
    INSTALL: ClassVar[str] = "apt install liggghts"
    FASTEST: ClassVar[tuple[float, float]] = (0.3e-6, 8e-9)  # 4e-6 measured with 60 granules
    TERMS: ClassVar[tuple[str, ...]] = OF_OTHER_CODES
    ENVIRONMENT: ClassVar[dict[str, str]] = {"OMP_NUM_THREADS": "1"}

    WRITER: ClassVar[ModuleType] = sys.modules[__name__]

    program: str = "liggghts"

    def method_of(self, scene: Scene) -> str:  # noqa: ARG002 - the same for all
        """Return the name of the method in the result."""
        return "velocity-verlet, gran model hertz"

    def refuse(self, scene: Scene) -> None:
        """Raise RunFailed for a scene that LIGGGHTS cannot simulate."""
        super().refuse(scene)
        if scene.contact is not None and scene.contact.parameter <= _LEAST_RESTITUTION:
            raise RunFailed(
                f"LIGGGHTS takes a restitution above {_LEAST_RESTITUTION:g}, this one is"
                f" {scene.contact.parameter:g}: take another backend"
            )
        ratios = {"chain": float(np.min(scene.granules.poisson_ratio))}
        if scene.wall is not None and scene.wall.poisson_ratio is not None:
            ratios["wall"] = scene.wall.poisson_ratio
        for whose, ratio in ratios.items():
            if ratio < 0:
                raise RunFailed(
                    f"LIGGGHTS has no Poisson's ratio below 0, this {whose} has {ratio:g}: take"
                    " another backend"
                )

    def command(self, program: str) -> list[str]:
        """Return the command that runs ``FILE``."""
        return [program, "-in", self.FILE, "-log", _LOG, "-echo", "none"]

    def replay(self, folder: Path, scene: Scene, strides: Sequence[int], seen: Observation) -> str:
        """Pass the readings that LIGGGHTS left to the observation; return its version."""
        _, rest = read_frames(folder / AT_REST, GRANULES)
        _, frames = read_frames(folder / READINGS, columns_of(scene))
        # The force on the wall is opposite to that on the last granule.
        count = len(COLUMNS)
        wall_force = None if scene.wall is None else -frames[:, count, -1]
        seen.replay(Granules(*rest[0]), frames[:, :count], strides, wall_force)
        log = (folder / _LOG).read_text(encoding="utf-8", errors="replace")
        match = re.search(r"LIGGGHTS\S* \d\S*\d", log.partition("\n")[0])
        return match.group() if match else "unknown"
