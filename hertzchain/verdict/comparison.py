"""The comparison of all oracles on a scene: rows, checks and a verdict.

It separates three differences: LAMMPS's numbers from the scene, by round-off; codes from native
velocity Verlet at the same steps, by round-off; each simulation from the reference, by its steps.
The formulas never decide.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from hertzchain.arrays import or_none
from hertzchain.engines.lammps import Lammps
from hertzchain.engines.native import Native
from hertzchain.engines.registry import ENGINES, Simulator, compared_by_default, label_of, others
from hertzchain.errors import BackendMissing, OverlapTooLarge, RunFailed, TooExpensive, require
from hertzchain.limits import TIME_LIMIT
from hertzchain.observables.definitions import context_of
from hertzchain.observables.result import Result
from hertzchain.scene.given import SceneLike, to_scene
from hertzchain.scene.scene import Scene
from hertzchain.showing import ShownVerdict, ShowProgress, telling
from hertzchain.verdict.check import FAILED, NOT_RUN, Check, unmeasured
from hertzchain.verdict.deck_numbers import examined
from hertzchain.verdict.formulas import Formulas, formulas
from hertzchain.verdict.run_checks import balance_checks, code_checks, yardstick_check

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False)
class Comparison(ShownVerdict):
    """Every oracle on one scene, side by side.

    It is true if the verdict is ``pass``.

    Parameters
    ----------
    scene
        The scene.
    results
        Results by names of backends: the reference method as native, and the others that ran.
    wanted
        Names of the backends that have a column in the rows: native, LAMMPS and the others that
        were asked for.
    formulas
        The paper's formulas with p and F_SW of the reference.
    checks
        All checks; they decide the verdict.
    missing
        Whether a backend that was asked for is missing.
    """

    scene: Scene
    results: Mapping[str, Result]
    wanted: tuple[str, ...]
    formulas: Formulas
    checks: tuple[Check, ...]
    missing: bool

    @property
    def native(self) -> Result:
        """The reference method."""
        return self.results["native"]

    @property
    def lammps(self) -> Result | None:
        """Result of LAMMPS; None where it was not asked for or did not run."""
        return self.results.get("lammps")

    @property
    def verdict(self) -> str:
        """``pass`` if every check passed, otherwise ``fail``."""
        return "pass" if all(check.passed for check in self.checks) else "fail"

    @property
    def rows(self) -> list[dict[str, float | int | None]]:
        """Return one row per contact; None where undefined.

        The keys are contact, native_N, lammps_N, those of other backends, eq6_N and eq9_N.
        """
        nothing = [None] * self.native.contact.size
        peaks = {name: result.peak_force.tolist() for name, result in self.results.items()}
        columns = {
            "contact": self.native.contact.tolist(),
            **{f"{name}_N": peaks.get(name, nothing) for name in self.wanted},
            "eq6_N": or_none(self.formulas.eq6),
            "eq9_N": or_none(self.formulas.eq9),
        }
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def to_frame(self) -> pandas.DataFrame:
        """Return the rows as a table."""
        import pandas

        return pandas.DataFrame(self.rows)

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison as a JSON object."""
        return {
            "verdict": self.verdict,
            "rows": self.rows,
            "checks": [check.to_dict() for check in self.checks],
            "formulas": self.formulas.to_dict(),
            "results": {name: result.numbers() for name, result in self.results.items()},
            **context_of(self.scene),
        }


def compare(
    scene: SceneLike,
    backends: Sequence[str] | None = None,
    lammps: Lammps | None = None,
    progress: ShowProgress = None,
    liggghts: Simulator | None = None,
    yade: Simulator | None = None,
    record: ArrayLike | None = None,
    engines: Mapping[str, Simulator] | None = None,
) -> Comparison:
    """Run every oracle on a scene, and judge the results.

    Parameters
    ----------
    scene
        What to simulate, or the path of its file.
    backends
        Simulations to compare: native, lammps, liggghts, yade; by default native and lammps. The
        native reference always runs.
    lammps, liggghts, yade
        Backends with their parameters; the same as ``engines`` with that name.
    progress
        True for a line in the terminal or notebook on what is being done, or a function that is
        called with each such line.
    record
        Times at which each backend keeps displacement, velocity and contact force: increasing times
        [s] within the run, or a whole number of frames, equally spaced from 0 to the end; by
        default none.
    engines
        Backends by name; by default with steps for an error of 1e-6 and the time limit of LAMMPS,
        which also holds for the reference.

    Raises
    ------
    SceneError
        For anything but a scene, a backend that does not exist, or impossible times.
    """
    scene = to_scene(scene)
    backends = compared_by_default() if backends is None else backends
    for name in backends:
        require(name in ENGINES, "backend", name, f"must be one of {', '.join(ENGINES)}")
    named = {"lammps": lammps, "liggghts": liggghts, "yade": yade}
    given = {name: engine for name, engine in named.items() if engine}
    for name, engine in (engines or {}).items():
        require(name in others(), "engines", name, f"must be one of {', '.join(others())}")
        require(name not in given, "engines", name, "is given twice")
        given[name] = engine
    with telling(progress) as report_progress:
        return _compared(scene, backends, given, record, report_progress)


def _compared(
    scene: Scene,
    backends: Sequence[str],
    given: Mapping[str, Simulator],
    record: ArrayLike | None,
    report_progress: Callable[[str], object],
) -> Comparison:
    """As ``compare``, with the engines that are given by name."""
    report_progress("native: the reference method")
    limit = given["lammps"].time_limit if "lammps" in given else TIME_LIMIT
    native = Native("reference", time_limit=limit).run(scene, record)
    checks = [*balance_checks(native), yardstick_check(native)]
    results, missing = {"native": native}, False
    for name in others():
        if name not in backends:
            continue
        engine = given.get(name) or ENGINES[name].make(time_limit=limit)
        try:
            report_progress(f"{label_of(name)}: the generated deck")
            results[name] = engine.run(scene, record)
        except BackendMissing as problem:
            missing = True
            checks.append(unmeasured(NOT_RUN, name, str(problem)))
            continue
        except RunFailed as problem:
            checks.append(unmeasured(FAILED, name, str(problem)))
            if isinstance(problem, OverlapTooLarge | TooExpensive):
                continue
        if isinstance(engine, Lammps):
            report_progress("LAMMPS: what it makes of the deck")
            checks += examined(scene, engine)
        if name in results:
            if results[name].scheme == "velocity-verlet":
                report_progress(f"native: velocity Verlet at the steps of {label_of(name)}")
            checks += code_checks(results[name], native, engine.time_limit)
    wanted = tuple(name for name in ENGINES if name in (*compared_by_default(), *backends))
    return Comparison(scene, results, wanted, formulas(native), tuple(checks), missing)
