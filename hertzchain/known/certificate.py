"""A certificate of a LAMMPS, LIGGGHTS or Yade: short scenes, compared with native at its steps."""

from __future__ import annotations

import functools
import math
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hertzchain.engines import registry
from hertzchain.engines.external.accuracy import softening
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.external.observation import Observation
from hertzchain.engines.lammps.backend import Binary, Lammps
from hertzchain.engines.lammps.engine import Program
from hertzchain.engines.native.backend import Native
from hertzchain.errors import (
    BackendMissing,
    HertzchainError,
    OverlapTooLarge,
    StepUnstable,
    require,
)
from hertzchain.files import write_text
from hertzchain.limits import Deadline
from hertzchain.observables.peaks import largest_difference
from hertzchain.observables.result import Result
from hertzchain.scene.chain import Chain
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Run
from hertzchain.scene.shocks import Piston, Profile, Pulse, Striker
from hertzchain.scene.terms import Contact, DampingLaw, Precompression, Wall

STEP = 0.02  # steps of all runs [natural time units]; chosen
_STEEL: dict[str, float] = {
    "radius": 4.75e-3, "young_modulus": 193e9, "poisson_ratio": 0.3, "density": 7958.0,
}  # fmt: skip
_ALUMINIUM = {"radius": 6e-3, "young_modulus": 69e9, "poisson_ratio": 0.33, "density": 2700.0}


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


Term = Any
"""A part of a scene: a striker, a wall, a static load, contacts."""

_LIKE = Chain(12, **_STEEL)
_UNLIKE = Chain(12, **{key: [of_steel, _ALUMINIUM[key]] * 6 for key, of_steel in _STEEL.items()})
"""Chains of steel, and with aluminium at every other place."""


def _ended(scene: Scene, units: float = 24.0) -> Scene:
    """Return a scene that ends after natural time units: a wave passes 12 granules twice in 24."""
    return replace(scene, run=Run(units * scene.contact_time))


def _struck(chain: Chain = _LIKE, **terms: Term) -> Scene:
    return _ended(Scene(chain, terms.pop("striker", Striker(1.0)), **terms))


def _pushed(profile: Profile = "cosine") -> Scene:
    return _ended(Scene(_LIKE, Pulse(profile, 100.0, 2.0, momentum_ratio=1.0)))


def _at_wall(wall: Wall, contact: Contact | None = None) -> Scene:
    return _struck(replace(_LIKE, granules=4), wall=wall, contact=contact)


def _damped(damping: DampingLaw, **law: Term) -> Scene:
    return _struck(_UNLIKE, contact=Contact(damping, **law))


def _restarted(text: str, ranks: int) -> str:
    """Return a deck that stops after the pulse and continues from a restart file."""
    # LAMMPS of 2022 to 2025 restores granular with a cutoff of 0, without granules of other ranks.
    law = text[text.index("pair_style") : text.index("# Wide enough")]
    commands = [
        "unfix shock", "write_restart middle.restart", "clear", f"processors {ranks} 1 1",
        "comm_modify vel yes", "read_restart middle.restart", law, "fix motion all nve",
        "thermo_style custom step",
    ]  # fmt: skip
    return text.replace("unfix shock", "\n".join(commands))


def _in_cgs(scene: Scene) -> Scene:
    """Return a scene with the numbers of another in units of cgs."""
    units = {
        "radius": 1e2, "young_modulus": 10.0, "density": 1e-3, "velocity": 1e2, "gravity": 1e2,
        "force": 1e5, "peak_force": 1e5,
    }  # fmt: skip

    def scaled(part: Term) -> Term:
        numbers = {key: getattr(part, key, None) for key in units}
        cgs = {key: by * units[key] for key, by in numbers.items() if isinstance(by, float)}
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
        "damping, restitution", "damping coeff_restitution",
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
        _ended(_struck(replace(_LIKE, granules=40)), 45.0), "nve", needs_ranks=True, of_lammps=True,
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


ROUND_OFF, STEPS = "right to round-off", "right to the steps"
WRONG, UNSUPPORTED, UNTESTED = "wrong", "not supported", "not tested"
GRADES = ROUND_OFF, STEPS, WRONG, UNSUPPORTED, UNTESTED

ROUNDED = 1e-9  # largest difference of the final state by rounding; 4e-11 measured, 2022 to 2025
INTERPOLATED = 3e-7  # largest difference of peaks between readings; 7e-8 measured

SUFFIXES: dict[str, tuple[str, ...]] = {
    "omp": ("-sf", "omp", "-pk", "omp", "2"),
    "kk": ("-k", "on", "-sf", "kk"),
    "intel": ("-sf", "intel"),
    "gpu": ("-sf", "gpu", "-pk", "gpu", "1"),
}
"""Suffixes of accelerated styles, with the options of LAMMPS that choose them."""

_UNKNOWN = re.compile(
    r"Unrecogni[sz]ed|Unknown|not enabled|not installed|Invalid (?:fix|pair|atom)|Illegal|package"
    r"|does not have the damping|Cannot (?:use|create)|\bnot support"
    r"|deck has no \w+ damping|never pull in",
    re.IGNORECASE,
)
"""Words of a code that lacks a style, an option of one, or a package."""

_BROKEN = re.compile(r"crashed|ended by SIG|do not trust")
"""Words of errors that a right program never prints."""


@dataclass(frozen=True)
class Row:
    """The result of one scene for a program."""

    case: Case
    grade: str  # one of ``GRADES``
    # largest relative difference from native of a peak or of the final state; None if unknown
    difference: float | None = None
    allowed: float | None = None  # error by the steps, of native's peaks; None if it did not run
    reason: str = ""  # why it is wrong, not supported or not tested; "" if it is right
    styles: tuple[str, ...] = ()  # of contacts, then of fixes, as the program lists them
    failed: bool = False  # whether the row was to be tested and could not be
    version: str = ""  # of the code that ran; "" if it did not

    @property
    def passed(self) -> bool:
        """True for a row that was tested and is right."""
        return self.grade in (ROUND_OFF, STEPS)

    @property
    def words(self) -> str:
        """The grade; for a wrong row with the size of the difference."""
        is_measured = self.grade == WRONG and self.difference is not None
        return f"wrong by {self.difference:.1e}" if is_measured else self.grade

    def to_dict(self) -> dict[str, Any]:
        """Return the row as a JSON object."""
        keys = ("grade", "difference", "allowed", "reason", "styles")
        values = {key: getattr(self, key) for key in keys}
        return {"name": self.case.name, "tests": self.case.tests, **values}


@dataclass(frozen=True)
class Certificate:
    """Rows of one program, in the order of the table."""

    program: str
    version: str  # the code's own number, of LAMMPS year month day; "" if unknown
    suffix: str | None
    ranks: int
    rows: tuple[Row, ...]
    seconds: float
    code: str = "LAMMPS"  # name of the code

    @property
    def status(self) -> int:
        """0 if all that was tested is right, 1 if a row is wrong, 2 if rows could not be tested."""
        if any(row.grade == WRONG for row in self.rows):
            return 1
        could = any(row.passed for row in self.rows) and not any(row.failed for row in self.rows)
        return 0 if could else 2

    @property
    def sentence(self) -> str:
        """Number of rows of each grade, in one line."""
        count = {grade: sum(row.grade == grade for row in self.rows) for grade in GRADES}
        grades = ", ".join(f"{number} {grade}" for grade, number in count.items() if number)
        wrong = ", ".join(row.case.name for row in self.rows if row.grade == WRONG)
        version = f"{self.code} {self.version}".strip()
        how = f" with -sf {self.suffix}" if self.suffix else ""
        on = f" on {self.ranks} ranks" if self.ranks > 1 else ""
        return f"{version} ({self.program}){how}{on}: {grades}" + (f": {wrong}" if wrong else "")

    def to_dict(self) -> dict[str, Any]:
        """Return the certificate as a JSON object."""
        keys = ("program", "code", "version", "suffix", "ranks", "status", "sentence", "seconds")
        rows = [row.to_dict() for row in self.rows]
        return {**{key: getattr(self, key) for key in keys}, "rows": rows}


@dataclass(frozen=True)
class _Watched(Program):
    """A LAMMPS that runs edited decks, and keeps the list of styles that it prints."""

    edit: Callable[[str], str] = str
    styles: list[str] = field(default_factory=list)

    def run(self, commands: str, folder: Path, deadline: Deadline) -> str:
        said = super().run(f"{self.edit(commands)}\ninfo system fixes", folder, deadline)
        self.styles.extend(re.findall(r"types = +\d+, +style = (\S+)", said))
        self.styles.extend(re.findall(r"^Fix\[.*style = ([^, ]+)", said, re.MULTILINE))
        return said


def certify(
    lmp: str | Path | None = None,
    *,
    suffix: str | None = None,
    ranks: int = 1,
    only: Sequence[str] = (),
    folder: Path | None = None,
    time_limit: float = 120.0,
    progress: Callable[[str], object] = lambda _: None,
) -> Certificate:
    """Compare a LAMMPS, LIGGGHTS or Yade with native, scene by scene, at the same steps.

    Parameters
    ----------
    lmp
        Path or name of a LAMMPS binary; by default the ``lammps`` Python module. A program whose
        name begins with liggghts or yade is taken for that code.
    suffix
        Suffix of accelerated styles: omp, kk, intel or gpu.
    ranks
        MPI ranks of the binary.
    only
        Names of the rows; by default all.
    folder
        An existing folder, for the scenes and the decks that are run.
    time_limit
        Time limit of each row [s]; it takes a second, on a busy machine ten.
    progress
        Receives the name of each row before it runs.

    Raises
    ------
    SceneError
        For a suffix, a name of a row or a number of ranks that is not possible.
    """
    names = ", ".join(SUFFIXES)
    require(suffix is None or suffix in SUFFIXES, "suffix", suffix, f"must be one of {names}")
    Lammps(lmp=lmp, ranks=ranks)  # refuses other ranks
    for name in only:
        require(name in CASES, "only", name, f"must be one of {', '.join(CASES)}")
    program, engine = None, _other_engine(lmp)
    if engine is not None:
        as_it_is = f"must be left out: {lmp} is run as it is"
        require(suffix is None, "suffix", suffix, as_it_is)
        require(ranks == 1, "ranks", ranks, as_it_is)
    begin, deadline, rows, missing = time.perf_counter(), Deadline(time_limit), [], ""
    try:
        program = engine or (
            Program.of_module(deadline) if lmp is None else Program.find(str(lmp), ranks, deadline)
        )
        if isinstance(program, Program) and suffix:
            program = replace(program, options=SUFFIXES[suffix])
    except HertzchainError as problem:
        missing = str(problem)
    for name in only or CASES:
        progress(name)
        case = CASES[name]
        if folder is not None:
            case.scene.to_toml(folder / f"{case.file}.toml")
        if program is None:
            rows.append(Row(case, UNTESTED, reason=missing, failed=True))
        else:
            rows.append(_graded(case, program, suffix, folder, time_limit))
    version = max(row.version for row in rows).rpartition(" ")[2]
    if isinstance(program, Program):
        version = program.build.version
    label = "the lammps module" if lmp is None else str(lmp)
    seconds = time.perf_counter() - begin
    code = "LAMMPS" if engine is None else engine.LABEL
    return Certificate(label, version, suffix, ranks, tuple(rows), seconds, code)


def _other_engine(lmp: str | Path | None) -> ProgramEngine | None:
    """Return the code other than LAMMPS that a program is by its name; None for LAMMPS."""
    for entry in registry.ENGINES.values():
        if lmp is not None and entry.program and Path(lmp).name.startswith(entry.program):
            engine = entry.make(program=str(lmp))
            assert isinstance(engine, ProgramEngine)
            return engine
    return None


def _graded(
    case: Case,
    program: Program | ProgramEngine,
    suffix: str | None,
    keep: Path | None,
    time_limit: float,
) -> Row:
    """Run the deck of a case once, and compare its final state and peaks with those of native."""
    from hertzchain.engines.native.verlet import stride_of

    ranks, untested = program.ranks if isinstance(program, Program) else 1, ""
    if isinstance(program, ProgramEngine) and case.of_lammps:
        untested = "a row for LAMMPS"
    elif case.needs_ranks and ranks == 1:
        untested = "one rank: ask for --ranks 2 or more"
    if untested:
        return Row(case, UNTESTED, reason=untested)

    def edit(text: str) -> str:
        text = case.edit(text, ranks)
        if keep is not None:
            write_text(keep / f"in.{case.file}", text)
        return text

    right, styles = expected(case.name), list[str]()
    row = Row(case, WRONG, allowed=float(right.error_estimate))
    scene, deadline, legs = case.scene, Deadline(time_limit), case.scene.schedule(case.dt)
    # Steps between readings: as native reads damped contacts, and 5 where they are elastic
    strides = [5 if scene.contact is None else stride_of(scene, leg) for leg in legs]
    scaling = softening(scene, sum(leg.steps for leg in legs))
    try:
        if isinstance(program, ProgramEngine):
            label, code = program.LABEL, program.code_of(scene, deadline, edit)
        else:
            parts = program.command, program.ranks, program.build, program.options
            watched = _Watched(*parts, edit, styles)
            label, code = "LAMMPS", Binary(case.pair_style, deadline, watched).run
        seen = Observation(scene, scaling, legs, None, label)
        run = seen.simulation(code(scaling.scene(scene), seen.legs, strides, seen))
    except HertzchainError as problem:
        said = str(problem)
        wrong = isinstance(problem, StepUnstable | OverlapTooLarge) or _BROKEN.search(said)
        lacks = not isinstance(problem, BackendMissing) and _UNKNOWN.search(said)
        grade = WRONG if wrong else UNSUPPORTED if lacks else UNTESTED
        return replace(
            row, grade=grade, reason=said, styles=tuple(styles), failed=grade == UNTESTED
        )
    # Differences of the final state over its largest, and of peaks.
    states = (run.displacement, right.displacement), (run.velocity, right.velocity)
    state = max(float(np.max(np.abs(a - b)) / np.max(np.abs(b))) for a, b in states)
    peaks = largest_difference(run.peaks.force, right.peak_force)
    worst = float(np.max([state, peaks]))  # NaN if one is NaN
    row = replace(row, difference=worst, styles=tuple(styles), version=run.version)
    if not math.isfinite(worst):
        return replace(row, difference=None, reason="results are not numbers")
    if worst > max(right.error_estimate, INTERPOLATED):
        off = f"differs from native by more than the steps' {right.error_estimate:.1e}"
        return replace(row, reason=off)
    if suffix and not any(style.startswith(f"{case.style}/{suffix}") for style in styles):
        reason = f"{case.style} ran without /{suffix}: this program has no such style"
        return replace(row, grade=UNTESTED, reason=reason)
    is_rounded = state <= ROUNDED and peaks <= INTERPOLATED
    return replace(row, grade=ROUND_OFF if is_rounded else STEPS)
