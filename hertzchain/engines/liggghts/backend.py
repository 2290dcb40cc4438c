"""The LIGGGHTS backend: scene in, result out."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from numpy.typing import ArrayLike

from hertzchain.arrays import FloatArray
from hertzchain.engines.external import backend as verlet
from hertzchain.engines.external import recorded
from hertzchain.engines.external.dumps import read_frames
from hertzchain.engines.external.observation import Simulation
from hertzchain.engines.external.program import find_program, run_program, work_folder
from hertzchain.engines.external.readings import Granules
from hertzchain.engines.external.rescaling import softening
from hertzchain.engines.liggghts import deck
from hertzchain.errors import RunFailed
from hertzchain.limits import TIME_LIMIT, Deadline, check_time_limit
from hertzchain.observables.history import wanted_times
from hertzchain.observables.result import Result
from hertzchain.scene.scene import Scene, require_scene
from hertzchain.scene.schedule import Leg

_FASTEST_STEP, _FASTEST_GRANULE = 0.3e-6, 8e-9
"""Time of a step, and of each granule in it, [s]; 4e-6 measured with 60 granules."""

_LOG = "log.liggghts"

_TO_DO = "install it with: apt install liggghts"


@dataclass(frozen=True)
class Liggghts:
    """A generated deck, run by the program ``liggghts``, a fork of LAMMPS.

    Each run starts the program, which takes half a second. It knows Poisson's ratios from 0 to 0.5
    only.

    Parameters
    ----------
    dt
        The largest step [s]; by default one whose estimated error is at most ``rtol``.
    read_every
        Steps between two readings of the state, of the coarsest run where ``extrapolated``; by
        default so many that 0.3 natural time units pass at most.
    rtol
        Wanted relative error of the peaks, where no step is asked for.
    extrapolated
        Whether peaks and their times are extrapolated from two runs, one with half the steps of the
        other (Richardson); see ``Lammps``.
    program
        Its path, or its name on the search path.
    time_limit
        How long a run may take [s], all that finds its step and its error included.

    Raises
    ------
    SceneError
        For a step or a time limit that is not a finite number above 0, readings less than one step
        apart, or an error that is not between 0 and 1.
    """

    dt: float | None = None
    read_every: int | None = None
    rtol: float = 1e-6
    extrapolated: bool = False
    program: str = "liggghts"
    time_limit: float = TIME_LIMIT

    def __post_init__(self) -> None:
        check_time_limit(self.time_limit)
        _ = self._steps  # what cannot be is said at once

    @property
    def _steps(self) -> verlet.Steps:
        return verlet.Steps(self.dt, self.read_every, self.rtol, self.extrapolated)

    def run(self, scene: Scene, record: ArrayLike | None = None) -> Result:
        """Simulate a scene.

        Parameters
        ----------
        scene
            What to simulate.
        record
            Increasing times [s] within the run at which to keep displacement, velocity and
            contact force.

        Raises
        ------
        SceneError
            For what is no scene, or times that cannot be.
        BackendMissing
            If LIGGGHTS is not there.
        StepUnstable
            If the step asked for is so long that the motion diverges.
        OverlapTooLarge
            If granules would be pressed into one another by more than a radius.
        RunFailed
            If LIGGGHTS stops with an error or crashes, or Poisson's ratio is below 0.
        TooExpensive
            If it takes longer than the time limit.
        """
        require_scene(scene)
        begin = time.perf_counter()
        times = None if record is None else wanted_times(record, scene.end_time)
        program = find_program(self.program, _TO_DO)
        if scene.chain.poisson_ratio < 0:
            raise RunFailed(
                f"LIGGGHTS knows no Poisson's ratio below 0, this chain has"
                f" {scene.chain.poisson_ratio:g}: take another backend"
            )
        result = verlet.run(
            scene,
            _Program(scene, program, Deadline(self.time_limit)).simulate,
            self._steps,
            times,
            code="LIGGGHTS",
            method="velocity-verlet, gran model hertz",
        )
        return replace(result, wall_time=time.perf_counter() - begin)


@dataclass(frozen=True)
class _Program:
    """A scene, run by a process of its own."""

    scene: Scene
    program: str
    deadline: Deadline

    def simulate(
        self, legs: Sequence[Leg], strides: Sequence[int], times: FloatArray | None
    ) -> Simulation:
        """Run the deck of the scene once, reading it every so many steps of each leg.

        Where coordinates would cost too many digits, LIGGGHTS gets a similar scene; what is read is
        at once that of the true one again.
        """
        scene, steps = self.scene, sum(leg.steps for leg in legs)
        granules = scene.chain.granules
        made = softening(scene, steps)
        self.deadline.refuse(steps * (_FASTEST_STEP + granules * _FASTEST_GRANULE))
        recorded.refuse_large(legs, strides, granules)
        text = deck.watched(made.scene(scene), [made.leg(leg) for leg in legs], strides)
        with work_folder("LIGGGHTS") as folder:
            (folder / "in.chain").write_text(text, encoding="ascii")
            command = [self.program, "-in", "in.chain", "-log", _LOG, "-echo", "none"]
            run_program(command, folder, self.deadline, "LIGGGHTS", OMP_NUM_THREADS="1")
            _, rest = read_frames(folder / deck.AT_REST, deck.GRANULES)
            _, readings = read_frames(folder / deck.READINGS, deck.COLUMNS)
            version = _version(folder / _LOG)
        return recorded.observe(
            scene, made, Granules(*rest[0]), readings, legs, strides, times, "LIGGGHTS", version
        )


def _version(log: Path) -> str:
    """What LIGGGHTS says of itself in the first line of its log."""
    with log.open(encoding="utf-8", errors="replace") as lines:
        first = lines.readline()
    found = re.search(r"LIGGGHTS\S* \d\S*\d", first)
    return found.group() if found else "unknown"
