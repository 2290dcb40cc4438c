"""Likely causes: which common mistake would have given these peaks.

Each mistake is made on purpose, by simulation, and its one parameter fitted to the peaks in
question. A mistake is named only if it leaves at most a tenth of the differences unexplained.
What peaks cannot tell apart is named together: in natural units a stiffer chain, a lighter one and
a longer pulse are the same chain.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.native import METHODS, Native, simulate
from hertzchain.errors import RunFailed, SceneError, TooExpensive
from hertzchain.limits import Deadline
from hertzchain.observables.error_bound import stable_step
from hertzchain.observables.history import Recorder
from hertzchain.observables.result import Result
from hertzchain.observables.transition import FREE_END
from hertzchain.scene.pulse import Pulse, PulseTable, Ramp
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg
from hertzchain.verdict.other_laws import HERTZ, Law, peaks

EXPLAINED = 0.1
"""Of the differences, root mean square: the most that a mistake which is named may leave."""

FEWEST = 6
"""Contacts: fewer are on a curve with one parameter too easily."""

FEWEST_SAMPLED = 12
"""Contacts, where a million steps are tried: random numbers pass once in 1e5 cases then."""

_CERTAIN = 1e-4
"""Of the differences: a mistake that leaves no more is not looked past."""

_FLOOR = 1e-7
"""Differences below are beside what the trial runs are known to, 1e-8."""

_LOWEST = 1e-9
"""Of the truth: lower peaks are as good as none."""

_ALIKE = 3.0
"""Times what the best mistake leaves: others that leave no more are named beside it."""

_NEAR = 0.003
"""Relative: how near a fitted factor has to be to a well-known one for that to be named."""


_ALONE = 100.0
"""Times as far off as any other contact: then it is that one. Chosen; of the mistakes that the
tests make only another length of the chain, which moves the last contact, goes beyond."""


@dataclass(frozen=True)
class Cause:
    """A mistake, in words, and what it leaves of the differences (``Case.residual``)."""

    sentence: str
    residual: float


@dataclass(frozen=True, eq=False)
class Case:
    """Peaks to be explained.

    Parameters
    ----------
    scene, reference
        The scene, and the truth of it.
    given
        Peak forces in question [N], shape (N - 1,), NaN where there is none.
    judged
        The contacts to look at, shape (N - 1,).
    dt
        The step they were computed with [s], if it is known.
    deadline
        When to stop looking.
    """

    scene: Scene
    reference: Result
    given: FloatArray
    judged: NDArray[np.bool_]
    dt: float | None
    deadline: Deadline

    @property
    def differences(self) -> FloatArray:
        """Relative differences from the truth, of the judged contacts."""
        return self.given[self.judged] / self.reference.peak_force[self.judged] - 1.0

    @property
    def size(self) -> float:
        """How large the differences are: what the truth leaves of them."""
        return self.residual(self.reference.peak_force) if self.judged.any() else 0.0

    def residual(self, peak_force: FloatArray) -> float:
        """What other peaks [N], shape (N - 1,), leave of the differences.

        Logarithms, so that a thousandth and a hundredth of the truth are not both just too low.
        """
        lowest = _LOWEST * self.reference.peak_force[self.judged]
        ratio = np.maximum(self.given[self.judged], lowest) / np.maximum(
            peak_force[self.judged], lowest
        )
        found = float(np.sqrt(np.mean(np.log(ratio) ** 2)))
        return found if math.isfinite(found) else math.inf

    def of(self, scene: Scene) -> FloatArray:
        """True peaks of another scene [N]; NaN where there are none."""
        try:
            run = Native(rtol=1e-8, peaks_only=True, time_limit=max(self.deadline.left, 1e-3))
            return run.run(scene).peak_force
        except TooExpensive:
            raise
        except (RunFailed, SceneError):
            return np.full_like(self.given, np.nan)

    def fit(
        self, family: Callable[[float], FloatArray], trials: Sequence[float]
    ) -> tuple[float, float]:
        """The parameter with which a family of peaks leaves the least, and what it leaves.

        Parameters
        ----------
        family
            Peak forces [N] for a parameter.
        trials
            Increasing; looked for is the best between the neighbours of each that is better than
            they are, as the best of them need not lie in the deepest valley.
        """
        from scipy.optimize import minimize_scalar

        left = [self.residual(family(x)) for x in trials]
        k = int(np.argmin(left))
        best, least = trials[k], left[k]
        if not math.isfinite(least):
            return best, math.inf
        for k in _valleys(left):
            bounds = trials[max(k - 1, 0)], trials[min(k + 1, len(trials) - 1)]
            square = minimize_scalar(
                lambda x: min(self.residual(family(x)), 1e100) ** 2,
                bounds=bounds,
                method="bounded",
                options={"xatol": 1e-9 * (bounds[1] - bounds[0])},
            )
            found = self.residual(family(float(square.x)))
            if found < least:
                best, least = float(square.x), found
        return best, least


def _valleys(values: Sequence[float]) -> list[int]:
    """Where values are finite and no higher than their neighbours."""
    walled = [math.inf, *values, math.inf]
    return [
        k
        for k, value in enumerate(values)
        if math.isfinite(value) and value <= min(walled[k], walled[k + 2])
    ]


Finder = Callable[[Case], Iterator[Cause]]


def likely_cause(
    case: Case, progress: Callable[[str], object] | None = None
) -> tuple[str | None, str | None]:
    """The mistakes that explain the differences best, as a sentence, and what was not tried.

    Parameters
    ----------
    case
        What to explain.
    progress
        Is called with a line of text before each part of the work.

    Returns
    -------
    The cause, None where no known mistake leaves a tenth or less; and a remark, None where
    everything was tried.
    """
    size = case.size
    if size < max(_FLOOR, 10 * case.reference.error_estimate):
        return None, None
    if np.count_nonzero(case.judged) < FEWEST:
        return None, f"the cause is sought where at least {FEWEST} contacts are judged"
    if (alone := _one_contact(case)) is not None:
        return alone, None
    found: list[Cause] = []
    remark = None
    for name, find in FINDERS.items():
        if name in DEAR and any(one.residual <= _CERTAIN * size for one in found):
            continue  # nothing else could leave as little
        if progress is not None:
            progress(f"looking for the cause: {name}")
        try:
            found += find(case)
        except TooExpensive:
            remark = f"not everything was tried for the cause, it takes too long: {name}"
            break
        except RunFailed:  # this mistake cannot be made in this scene
            continue
    found = sorted((one for one in found if one.residual <= EXPLAINED * size), key=_residual)
    if not found:
        return None, remark
    alike = _ALIKE * max(found[0].residual, 1e-3 * size)
    sentences = [one.sentence for one in found if one.residual <= alike]
    left = f"; leaves {max(found[0].residual / size, 1e-6):.1g} of the differences"
    return "; or ".join(dict.fromkeys(sentences)) + left, remark


def _one_contact(case: Case) -> str | None:
    """The contact that alone is off; mistakes do that at the free end only."""
    off = np.abs(case.differences)
    *_, next_to, most = np.sort(off)
    if most < _ALONE * next_to:
        return None
    contact = case.reference.contact[case.judged][int(np.argmax(off))]
    if contact > case.scene.chain.granules - FREE_END:
        return None
    others = f"within {next_to:.1g} of the truth" if next_to else "right"
    return f"contact {contact} alone, as if a number had slipped: the others are {others}"


def _residual(cause: Cause) -> float:
    return cause.residual


def other_stiffness(case: Case) -> Iterator[Cause]:
    """Stiffness, mass or duration off by a factor: all of them are another LM_ratio."""
    scene = with_rise_time(case.scene)
    log, left = case.fit(
        lambda x: case.of(_stiffer(scene, math.exp(3 * x))), list(np.linspace(-3.0, 3.0, 31))
    )
    yield Cause(_in_words(scene, math.exp(log)), left)
    # Further away than any fit goes: the contact force as the paper prints it, sqrt(2 R E).
    printed = scene.chain.young_modulus**-0.5
    left = case.residual(case.of(_stiffer(scene, printed)))
    yield Cause("contact stiffness of Eq. 1 as printed, with E under the root", left)


def _stiffer(scene: Scene, factor: float) -> Scene:
    return replace(
        scene, chain=replace(scene.chain, young_modulus=factor * scene.chain.young_modulus)
    )


def with_rise_time(scene: Scene) -> Scene:
    """The same scene, its pulse measured in seconds, which stay if the chain becomes another."""
    pulse = scene.shock
    if not isinstance(pulse, Pulse):
        return scene
    return replace(scene, shock=replace(pulse, momentum_ratio=None, rise_time=scene.rise_time))


def _in_words(scene: Scene, stretch: float) -> str:
    """What makes the pulse so many times as long in natural units."""
    nu = scene.chain.poisson_ratio
    known = {
        "effective modulus E/(1 - nu^2) in place of half of it": 2 ** (1 / 3),
        "effective modulus E in place of E/(2 (1 - nu^2))": (2 * (1 - nu**2)) ** (1 / 3),
        "effective modulus halved twice": 0.5 ** (1 / 3),
        "E in place of E/(1 - nu^2)": (1 - nu**2) ** (1 / 3),
        "1 - nu in place of 1 - nu^2": (1 + nu) ** (1 / 3),
        "R in place of the effective radius R/2": 2 ** (1 / 6),
        "diameter taken for radius": 2 ** (-4 / 3),
        "radius taken for diameter": 2 ** (4 / 3),
        "diameter taken for radius in the mass": 8**-0.5,
        "radius taken for diameter in the mass": 8**0.5,
        "half the mass": 2**0.5,
        "twice the mass": 0.5**0.5,
    }
    if isinstance(scene.shock, Pulse):
        n = scene.shock.duration_ratio
        known |= {"duration taken for rise time": n, "rise time taken for duration": 1 / n}
    # 1 - nu^2 is 1 where nu is 0; then there is nothing to mistake.
    names = [
        name for name, q in known.items() if abs(stretch / q - 1) < min(_NEAR, 0.1 * abs(q - 1))
    ]
    text = (
        f"contact stiffness {stretch**3:.6g} times that of the scene, or mass {stretch**-2:.6g}"
        f" times, or pulse {stretch:.6g} times as long (peaks cannot tell these apart)"
    )
    return f"{text}: {' or '.join(names)}" if names else text


def other_force(case: Case) -> Iterator[Cause]:
    """The applied force, or the unit of the peaks, off by a factor."""
    scene = with_rise_time(case.scene)
    log, left = case.fit(
        lambda x: case.of(_pushed(scene, math.exp(x))), list(np.linspace(-5.0, 5.0, 41))
    )
    yield Cause(f"applied force {math.exp(log):.6g} times that of the scene", left)
    expected, given = case.reference.peak_force, case.given[case.judged]
    ratio = expected[case.judged] / expected.max()
    weight = 1 / ratio**2  # as residuals are relative
    factor = float(np.sum(weight * given * ratio) / np.sum(weight * ratio**2)) / expected.max()
    units = {
        "kN": 1e-3, "MN": 1e-6, "mN": 1e3, "uN": 1e6, "dyn": 1e5, "kgf": 1 / 9.80665,
        "lbf": 1 / 4.4482216, "F0": 1 / case.scene.units.force,
    }  # fmt: skip
    names = [f"in units of {unit}" for unit, q in units.items() if abs(factor / q - 1) < _NEAR]
    if not factor > 0:
        yield Cause("no contact was pressed, or none was read", case.residual(0 * expected))
        return
    text = f"every peak {factor:.6g} times the true one: "
    why = " or ".join(names) or "another unit, or another applied force at the same LM_ratio"
    yield Cause(text + why, case.residual(factor * expected))


def _pushed(scene: Scene, factor: float) -> Scene:
    shock = scene.shock
    if isinstance(shock, Pulse):
        return replace(scene, shock=replace(shock, peak_force=factor * shock.peak_force))
    force = tuple(factor * value for value in shock.force)
    return replace(scene, shock=PulseTable(shock.time, force, shock.file))


def other_numbers(case: Case) -> Iterator[Cause]:
    """Contacts numbered otherwise, or another number of granules."""
    expected, unknown = case.reference.peak_force, [np.nan]
    for text, peak_force in (
        ("contact i has the peak of contact i + 1", np.append(expected[1:], unknown)),
        ("contact i has the peak of contact i - 1", np.append(unknown, expected[:-1])),
        ("contacts are numbered from the far end", expected[::-1]),
    ):
        yield Cause(text, _of_known(case, peak_force))
    chain = case.scene.chain
    for granules in (chain.granules - 1, chain.granules + 1):
        scene = with_rise_time(case.scene)
        peak_force = case.of(replace(scene, chain=replace(chain, granules=granules)))
        peak_force = np.append(peak_force, unknown)[: expected.size]
        text = f"a chain of {granules} granules, not {chain.granules}"
        yield Cause(text, _of_known(case, peak_force))


def _of_known(case: Case, peak_force: FloatArray) -> float:
    """What peaks leave of the differences where they are known: everywhere but at one end."""
    known = case.judged & np.isfinite(peak_force)
    if np.count_nonzero(known) < FEWEST:
        return math.inf
    return replace(case, judged=known).residual(peak_force)


def other_contacts(case: Case) -> Iterator[Cause]:
    """Another exponent, or contacts that pull; the stiffness may be any."""
    logs = np.linspace(-2.0, 2.0, 17)
    one = np.zeros(1)
    for text, law in (
        ("contact force linear in the overlap", Law(exponent=1.0)),
        ("springs that push and pull", Law(exponent=1.0, pulls=True)),
        ("contact force that goes as overlap^(5/4)", Law(exponent=1.25)),
        ("contact force that goes as overlap^2", Law(exponent=2.0)),
    ):

        def peaks_at(logs: FloatArray, law: Law = law) -> FloatArray:
            found, _ = peaks(case.scene, law, 0 * logs, np.exp(logs), case.deadline)
            return found * case.scene.units.force

        log, left = _fit_many(case, logs, peaks_at)
        yield Cause(
            f"{text}, with {math.exp(2 * law.exponent * log):.3g} times the stiffness at F0", left
        )
    beside, pulling = (
        peaks(case.scene, law, one, one + 1, case.deadline)[0][0]
        for law in (HERTZ, Law(pulls=True))
    )
    yield Cause("contacts that pull", case.residual(_against(case, pulling, beside)))


def _against(case: Case, found: FloatArray, beside: FloatArray) -> FloatArray:
    """Peaks [N], without what RK4 makes of Eq. 1: shape (..., contacts)."""
    pressed = beside > 0
    ratio = found / np.where(pressed, beside, 1.0)
    return np.asarray(np.where(pressed, ratio, 0.0) * case.reference.peak_force)


_ROOTS = np.linspace(0.0, 1.25, 14)
_FORWARD = _ROOTS**2
_BACKWARD = -(np.linspace(0.6, 0.0, 10)[:-1] ** 2)
"""Coefficients of damping, natural units: close to one another where little of it is seen."""


_OF_DRAG = 0.2
"""Granules that a drag holds back are held back for long: so much of the same coefficients."""


def damping(case: Case) -> Iterator[Cause]:
    """Damping on, of four kinds; and what acts like it, forces that are late."""
    units = case.scene.units
    for text, law, unit in (
        ("damping on, a dashpot in each contact", Law(damped_by="contact"), "N s/m"),
        (
            "damping on, as Tsuji's: overlap^(1/4) times its rate",
            Law(damped_by="contact", damping_exponent=0.25),
            "N s/m^(5/4)",
        ),
        (
            "damping on, as of viscoelastic spheres: overlap^(1/2) times its rate",
            Law(damped_by="contact", damping_exponent=0.5),
            "N s/m^(3/2)",
        ),
        ("damping on, a drag on each granule", Law(damped_by="drag"), "N s/m"),
    ):
        scale = units.force * units.time / units.length ** (1 + law.damping_exponent)
        forward = _OF_DRAG * _FORWARD if law.damped_by == "drag" else _FORWARD
        x, left = _fit_damping(case, law, forward, whole=True)
        yield Cause(f"{text}, coefficient {x * scale:.3g} {unit}", left)
        if law.damping_exponent == 0.5:
            # F(t - dt) = F - 3/2 dt overlap^(1/2) overlap': damping that gives energy.
            both_ways = np.concatenate([_BACKWARD, forward])
            x, left = _fit_damping(case, law, both_ways, whole=False)
            late = -x / 1.5 * units.time
            yield Cause(
                f"contact forces {late:.3g} s late, a step: explicit Euler, or forces from"
                " positions of the step before"
                if late > 0
                else f"contact forces {-late:.3g} s early: implicit Euler, or damping as of"
                " viscoelastic spheres that the peaks leave out",
                left,
            )


def _fit_damping(case: Case, law: Law, trials: FloatArray, whole: bool) -> tuple[float, float]:
    """The coefficient that leaves the least, natural units, and what it leaves.

    Parameters
    ----------
    case, law
        Peaks to be explained, and by what.
    trials
        Increasing coefficients.
    whole
        Whether peaks are those of the whole force, or of its elastic part.
    """

    def peaks_at(damping: FloatArray) -> FloatArray:
        tried = np.append(damping, 0.0)
        elastic, all_of_it = peaks(case.scene, law, tried, np.ones_like(tried), case.deadline)
        found = all_of_it if whole else elastic
        return _against(case, found[:-1], found[-1])

    return _fit_many(case, trials, peaks_at)


def _fit_many(
    case: Case, trials: FloatArray, peaks_at: Callable[[FloatArray], FloatArray]
) -> tuple[float, float]:
    """``Case.fit`` where many parameters cost little more than one; and once more, close to it."""
    from scipy.interpolate import Akima1DInterpolator

    best, least = 0.0, math.inf
    for _ in range(2):
        found = peaks_at(trials)
        there = np.all(np.isfinite(found) & (found > 0), axis=1)
        if np.count_nonzero(there) < 4:
            break
        # Local: where waves die out, or arrive after the end, must not matter elsewhere.
        curve = Akima1DInterpolator(trials[there], np.log(found[there]), method="makima")
        x, left = case.fit(lambda x, curve=curve: np.exp(curve(x)), trials[there].tolist())  # type: ignore[misc]
        if left < least:
            best, least = x, left
        if least > 3 * EXPLAINED * case.size:
            break
        k = min(max(int(np.searchsorted(trials, best)), 1), trials.size - 1)
        trials = best + 0.3 * (trials[k] - trials[k - 1]) * np.linspace(-1, 1, 7)
    return best, least


@dataclass(frozen=True, eq=False)
class Verlet:
    """Peaks of velocity Verlet [N]: interpolated maxima, and the highest samples."""

    interpolated: FloatArray
    sampled: FloatArray


def velocity_verlet(scene: Scene, legs: Sequence[Leg], deadline: Deadline) -> Verlet:
    """What velocity Verlet finds on some steps, with and without interpolation.

    Raises
    ------
    StepUnstable
        If the motion diverges.
    TooExpensive
        If it was not done by the deadline.
    """
    unit, walker = scene.units, METHODS["velocity-verlet"].walker
    run = simulate(scene, legs, walker, deadline=deadline)
    nodes = _nodes(legs) / unit.time
    # The highest sample is next to the peak: only there is the same run looked at once more.
    after = np.searchsorted(nodes, run.peaks.time[np.isfinite(run.peaks.time)])
    beside = np.clip(np.concatenate([after - 1, after, after + 1]), 0, nodes.size - 1)
    recorder = Recorder(np.unique(nodes[beside]), scene.chain.granules)
    simulate(scene, legs, walker, recorder, deadline=deadline)
    sampled = np.max(recorder.contact_force, axis=0, initial=0.0)
    return Verlet(run.peaks.force * unit.force, sampled * unit.force)


def _nodes(legs: Sequence[Leg]) -> FloatArray:
    """The ends of all steps [s]."""
    inner = [leg.start + leg.dt * np.arange(leg.steps) for leg in legs]
    return np.append(np.concatenate(inner), legs[-1].end)


_MOST_LEGS = 100_000
"""Legs of one step each that are made: half a second."""


def steps_with_force(nodes: FloatArray, force: FloatArray, steps_after: int) -> list[Leg]:
    """Legs of one step each, on which velocity Verlet sees these forces at these times.

    Parameters
    ----------
    nodes, force
        Ends of steps [s] and the force there [N], until the pulse is over.
    steps_after
        Steps of the length of the last one that follow without a force.
    """
    legs = [
        Leg(t0, t1, 1, Ramp(t0, t1, f0, f1, "linear"))
        for t0, t1, f0, f1 in zip(nodes, nodes[1:], force, force[1:], strict=False)
    ]
    if steps_after > 0:
        end = nodes[-1] + steps_after * (nodes[-1] - nodes[-2])
        legs.append(Leg(float(nodes[-1]), float(end), steps_after, None))
    return legs


def known_step(case: Case) -> Iterator[Cause]:
    """What comes of steps of the length given: samples in place of maxima, corners passed over.

    An applied force that is a step late is not among it. The pulses begin at 0, so the whole motion
    is a step late then, and no peak changes.
    """
    if case.dt is None:
        return
    scene, dt = case.scene, case.dt
    found = velocity_verlet(scene, scene.schedule(dt), case.deadline)
    step = f"velocity Verlet with steps of {dt:.3g} s"
    yield Cause(f"samples in place of maxima, {step}", case.residual(found.sampled))
    yield Cause(f"what {step} has", case.residual(found.interpolated))
    in_pulse = math.ceil(min(scene.ramps[-1].end, scene.end_time) / dt) + 1
    if in_pulse > _MOST_LEGS:
        return
    nodes = np.asarray(dt * np.arange(in_pulse + 1), np.float64)
    after = max(0, math.ceil(scene.end_time / dt) - in_pulse)
    legs = steps_with_force(nodes, scene.applied_force(nodes), after)
    passing = velocity_verlet(scene, legs, case.deadline)
    step += ", past the corners of the pulse"
    yield Cause(f"what {step} has", case.residual(passing.interpolated))
    yield Cause(f"samples in place of maxima, {step}", case.residual(passing.sampled))


def long_steps(case: Case) -> Iterator[Cause]:
    """Velocity Verlet with steps too long, of a length to be found."""
    scene = case.scene
    longest = 0.8 * stable_step(scene, METHODS["velocity-verlet"].interval)

    def family(dt: float) -> FloatArray:
        try:
            run = simulate(
                scene, scene.schedule(dt), METHODS["velocity-verlet"].walker,
                leave_behind=True, deadline=case.deadline,
            )  # fmt: skip
        except TooExpensive:
            raise
        except RunFailed:
            return np.full_like(case.given, np.nan)
        return np.asarray(run.peaks.force * scene.units.force)

    dt, left = case.fit(family, list(longest * np.geomspace(0.02, 1.0, 14)))
    yield Cause(f"what velocity Verlet with steps of some {dt:.3g} s has", left)


def samples(case: Case) -> Iterator[Cause]:
    """The highest of samples at equal intervals, of a length to be found.

    Near its peak at t a contact force falls off as the square; the nearest of the times k h lies
    t - k h away. So every h says how much each contact is too low, in a pattern of its own.
    """
    lower = case.differences
    if np.mean(lower) >= 0 or lower.size < FEWEST_SAMPLED:
        return
    unit = case.scene.units.time
    time = case.reference.peak_time[case.judged] / unit
    bend = _shape(case, np.array([-0.02, 0.0, 0.02]), 2)[0]
    h = math.sqrt(12 * max(float(np.mean(lower / bend)), 0.0))
    if not 1e-4 < h < 1.0:
        return
    shape = _shape(case, h * np.linspace(-0.7, 0.7, 5), 4)
    for text, slower, off in _ways(case, h):
        trials = np.arange(math.log(0.6 * h), math.log(1.7 * h), 0.1 * h / float(np.max(time)))
        if trials.size > 1_000_000:
            return

        def left(
            logs: FloatArray, slower: FloatArray = slower, off: FloatArray = off
        ) -> FloatArray:
            step = np.exp(logs)[:, np.newaxis]
            when = time + slower * step**2
            away = step * np.round(when / step) - when
            model = off * step**2
            for k, power in enumerate(range(shape.shape[0], 0, -1)):
                model = model + shape[k] * away**power
            return np.asarray(np.mean((model - lower) ** 2, axis=1))

        pieces = np.array_split(trials, max(1, trials.size // 500))  # what a cache holds
        values = np.concatenate([left(piece) for piece in pieces])
        apart = trials[1] - trials[0]
        near = trials[np.argsort(values)[:20], np.newaxis] + apart * np.linspace(-1, 1, 401)
        fine = np.array([left(some) for some in near])
        best = np.unravel_index(int(np.argmin(fine)), fine.shape)
        step = math.exp(near[best]) * unit
        yield Cause(
            f"samples in place of maxima, {step:.6g} s apart, {text}", math.sqrt(fine[best])
        )


def _ways(case: Case, h: float) -> Iterator[tuple[str, FloatArray, FloatArray]]:
    """Who samples: what its steps do to times and peaks, over the square of the step."""
    time, scene = case.reference.peak_time[case.judged], case.scene
    yield "of an accurate run", np.zeros_like(time), np.zeros_like(time)
    if h > 0.4:
        return
    legs = scene.schedule(h * scene.units.time)
    run = simulate(scene, legs, METHODS["velocity-verlet"].walker, deadline=case.deadline)
    late = (run.peaks.time[case.judged] - time / scene.units.time) / h**2
    expected = case.reference.peak_force[case.judged]
    off = (run.peaks.force[case.judged] * scene.units.force / expected - 1) / h**2
    yield "of velocity Verlet with such steps", late, off


def _shape(case: Case, offsets: FloatArray, degree: int) -> FloatArray:
    """Contact forces around their peaks as polynomials of the time from there.

    Parameters
    ----------
    case
        The judged contacts are looked at.
    offsets
        Where to look, natural time units.
    degree
        Of the polynomials.

    Returns
    -------
    Coefficients of the powers ``degree`` to 1, relative to the peak: shape (degree, contacts).
    """
    scene, unit = case.scene, case.scene.units.time
    peak_time = case.reference.peak_time[case.judged]
    wanted = peak_time + unit * offsets[:, np.newaxis]
    times, where = np.unique(np.clip(wanted, 0.0, scene.end_time), return_inverse=True)
    run = Native(rtol=1e-8, time_limit=max(case.deadline.left, 1e-3)).run(scene, record=times)
    assert run.history is not None
    contact = np.flatnonzero(case.judged)
    force = run.history.contact_force[where.reshape(wanted.shape), contact]
    relative = force / case.reference.peak_force[case.judged] - 1.0
    return np.asarray(np.polyfit(offsets, relative, degree)[:-1])


FINDERS: dict[str, Finder] = {
    "stiffness, mass or duration": other_stiffness,
    "applied force, units": other_force,
    "numbers of the contacts": other_numbers,
    "the step given": known_step,
    "steps too long": long_steps,
    "samples": samples,
    "damping": damping,
    "the contact law": other_contacts,
}
"""In the order in which they are tried."""

DEAR = ("samples", "damping", "the contact law")
"""Those that take seconds."""
