"""The comparison of all oracles on a scene: rows, checks and a verdict.

It separates three differences: LAMMPS's numbers from the scene, by round-off; codes from native
velocity Verlet at the same steps, by round-off; each simulation from the reference, by its steps.
The formulas never decide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any

from numpy.typing import ArrayLike

from hertzchain.arrays import or_none
from hertzchain.engines.external.accuracy import usual_accuracy
from hertzchain.engines.lammps.backend import Lammps
from hertzchain.engines.lammps.reading.deck import FoundDeck
from hertzchain.engines.native.backend import Native
from hertzchain.engines.registry import ENGINES, Simulator, compared_by_default, label_of, others
from hertzchain.errors import BackendMissing, OverlapTooLarge, RunFailed, TooExpensive, require
from hertzchain.examiner.examining import case_of_generated
from hertzchain.examiner.probes import checks_of, probes_of
from hertzchain.limits import TIME_LIMIT, Deadline
from hertzchain.observables.result import Result, context_of
from hertzchain.progress import ShowProgress, telling
from hertzchain.scene.scene import Scene, SceneLike, to_scene
from hertzchain.shown import ShownVerdict
from hertzchain.verdict.check import (
    FAILED,
    NOT_RUN,
    Check,
    Formulas,
    Kind,
    formulas,
    unmeasured,
    within,
)
from hertzchain.verdict.run_checks import (
    as_written_check,
    balance_checks,
    code_checks,
    is_quickly_written,
    yardstick_check,
)

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
        Names of the backends that were asked for, native always among them.
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
        """Result of LAMMPS; None if it was not requested or did not run."""
        return self.results.get("lammps")

    @property
    def verdict(self) -> str:
        """``pass`` if every check passed, otherwise ``fail``."""
        return "pass" if all(check.passed for check in self.checks) else "fail"

    @property
    def rows(self) -> list[dict[str, float | int | None]]:
        """Return one row per contact; None where undefined.

        The keys are contact, native_N, lammps_N, those of other backends that were asked for,
        eq6_N and eq9_N.
        """
        nothing = [None] * self.native.contact.size
        peaks = {name: result.peak_force.tolist() for name, result in self.results.items()}
        columns = {
            "contact": self.native.contact.tolist(),
            **{
                f"{name}_N": peaks.get(name, nothing)
                for name in ENGINES
                if name in (*compared_by_default(), *self.wanted)
            },
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
    engines: Annotated[Sequence[str | Simulator] | None, _by_name] = None,
    *,
    record: ArrayLike | None = None,
    as_written: bool = False,
    progress: ShowProgress = None,
) -> Comparison:
    """Run every oracle on a scene, and judge the results.

    Parameters
    ----------
    scene
        What to simulate, or the path of its file.
    engines
        Simulations to compare, each by name (native, lammps, liggghts, yade) or as a backend with
        its parameters, such as ``hertzchain.Lammps(rtol=1e-4)``; by default native and lammps. The
        native reference always runs, with the time limit of a ``Native("reference")`` that is given
        or the longest of the other backends. An engine by name has this time limit, too, and steps
        for an error of 1e-6, or of 1e-4 where dashpots close at a speed.
    record
        Times at which each backend keeps displacement, velocity and contact force: increasing times
        [s] within the run, or a whole number of frames, equally spaced from 0 to the end; by
        default none.
    as_written
        Whether the reference is always compared with Eq. 1 as ``engines/native/equations.py``
        writes it, even if this takes longer than a second or two.
    progress
        True for a line in the terminal on what is being done, or a function that is
        called with each such line.

    Raises
    ------
    SceneError
        For anything but a scene, an engine that does not exist or is given twice, ``Native`` with
        another method, or impossible times.
    """
    scene = to_scene(scene)
    given = _by_name(compared_by_default() if engines is None else engines)
    with telling(progress) as report_progress:
        reference = _reference(given)
        report_progress("native: the reference method")
        native = reference.run(scene, record)
        scene = native.scene  # with its end
        checks = [*balance_checks(native), yardstick_check(native)]
        if as_written or is_quickly_written(native):
            report_progress("native: Eq. 1 as it is written")
            check = as_written_check(native, reference.time_limit)
            # A time limit is not a verdict on what passed.
            checks += [check] if as_written or check.measured is not None else []
        else:
            said = "native: Eq. 1 as it is written takes long; ask for it with --as-written"
            report_progress(said)
        results, missing = {"native": native}, False
        for name in others():
            if name not in given:
                continue
            engine = given[name] or ENGINES[name].make(
                time_limit=reference.time_limit, rtol=usual_accuracy(scene)
            )
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
                report_progress("LAMMPS: reading the deck back")
                checks += examined(scene, engine)
            if name in results:
                if results[name].scheme == "velocity-verlet":
                    report_progress(f"native: velocity Verlet at the steps of {label_of(name)}")
                checks += code_checks(results[name], native, engine.time_limit)
    wanted = tuple(name for name in ENGINES if name in ("native", *given))
    return Comparison(scene, results, wanted, formulas(native), tuple(checks), missing)


def _by_name(engines: Sequence[str | Simulator]) -> dict[str, Simulator | None]:
    """Return the engines by name; None for those that are given by name alone."""
    allowed = "must be a list of names or backends, such as ['native', hertzchain.Lammps()]"
    is_list = isinstance(engines, Sequence) and not isinstance(engines, str)
    require(is_list, "engines", engines, allowed)
    given: dict[str, Simulator | None] = {}
    for engine in engines:
        name = engine if isinstance(engine, str) else getattr(engine, "name", None)
        allowed = f"must be a backend or one of {', '.join(ENGINES)}"
        require(isinstance(name, str) and name in ENGINES, "engines", engine, allowed)
        require(name not in given, "engines", engine, f"{name} is given twice")
        given[str(name)] = None if isinstance(engine, str) else engine
    return given


def _reference(given: Mapping[str, Simulator | None]) -> Native:
    """Return the native reference."""
    native = given.get("native")
    if native is None:
        limits = [engine.time_limit for engine in given.values() if engine is not None]
        return Native("reference", time_limit=max(limits, default=TIME_LIMIT))
    allowed = 'must be hertzchain.Native("reference"), as native is what others are compared with'
    reference = Native("reference", time_limit=native.time_limit)
    require(native == reference, "engines", native, allowed)
    return reference


_DECK_ADVICE = (
    "LAMMPS built something other than the scene from the deck: `hertzchain deck` writes the deck,"
    " `hertzchain lint` points at what is wrong in it"
)


def examined(scene: Scene, lammps: Lammps) -> list[Check]:
    """Check each number of the generated deck of a scene, as LAMMPS has it before the run."""
    try:
        return number_checks(scene, lammps.examine(scene), lammps.time_limit)
    except RunFailed as problem:
        return [unmeasured(Kind("not examined", _DECK_ADVICE), "lammps", str(problem))]


def number_checks(scene: Scene, deck: FoundDeck, time_limit: float = 60.0) -> list[Check]:
    """Return a check of each number that applies to a scene, by the probes for users' decks."""
    case = case_of_generated(scene, deck, Deadline(time_limit))
    checks: list[Check] = []
    for probe in probes_of(case):
        several = checks_of(case, probe)
        if not several:
            continue
        worst = next((number for number in several if number.differs), several[0])
        kind = Kind(f"{probe.name} [{probe.unit}]" if probe.unit else probe.name, _DECK_ADVICE)
        reason = "only round-off may differ" + (f"; {worst.sentence}" if worst.differs else "")
        if worst.measured is None or worst.expected is None:
            check = unmeasured(kind, "lammps", reason)
        else:
            numbers = float(worst.measured), float(worst.expected), worst.room or 0.0
            check = within(kind, "lammps", *numbers, reason)
            check = replace(check, passed=not worst.differs)
        checks.append(check)
        if len(checks) == 1 and not check.passed:  # of another chain the rest tells nothing
            break
    return checks
