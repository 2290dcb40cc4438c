"""Steps and expected answers of decks, by native; ``deck`` writes them without knowing native."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.external.rescaling import predicted_loss
from hertzchain.engines.lammps.deck import refuse_pair_style
from hertzchain.engines.native.backend import Native
from hertzchain.engines.native.damped_verlet import samples_of, simulate_damped_verlet
from hertzchain.engines.native.duration import with_end
from hertzchain.engines.native.plan import METHODS
from hertzchain.engines.native.simulation import simulate
from hertzchain.engines.registry import ENGINES
from hertzchain.errors import (
    POSITIVE,
    SceneError,
    TooExpensive,
    Unpredictable,
    is_positive,
    require,
)
from hertzchain.known import deck
from hertzchain.known.deck import ROOM, ROUNDING, KnownAnswer, Layout, similar
from hertzchain.limits import RTOL
from hertzchain.observables.error_bound import (
    SAFETIES,
    refuse_strong_dampers,
    refuse_unstable,
    stable_step,
    step_for,
)
from hertzchain.observables.peaks import judged_contacts, largest_difference
from hertzchain.observables.samples import Recorder
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg, Run

_FINEST = 1e-9  # least relative error of the peaks: needs three million steps
_PILOT_STEP = 0.04  # natural time units; step of the first run in the search for a wanted error
_LOOKING_INTERVAL = 0.005  # natural time units between two samples: costs the peaks 5e-6
_MOST_LOST = 3e-5  # largest relative error of the peaks by coordinates, of softer granules (chosen)
_SHIFTS = 4  # number of random starts that measure the amplification of rounding (chosen)
_MOST_STEPS = 1e7  # most steps of a deck: minutes of LAMMPS with 60 granules
_RTOL_OF_DAMPED = 1e-4  # default relative error, damped: errors go as dt, and 1e-6 takes hours
_UNSTABLE = 0.5  # largest fraction of the longest stable step, damped (chosen)
# fraction of the step found by trials, damped: sampling costs some accuracy (chosen)
_SHORTER = 0.7
_PHASES = 4  # least number of tried offsets of the samples, damped (chosen)
_READINGS = 2_000_000  # most times and granules recorded at once: 50 MB


def deck_step(scene: Scene, dt: float | None = None, rtol: float | None = None) -> float:
    """Return the step of a deck [natural time units], from the largest step ``dt`` [s] if given.

    Without ``dt`` the step is chosen for peaks of accuracy ``rtol`` and cut to two digits, so that
    it is the same on every machine. The default accuracy is 1e-6, or 1e-4 for damped contacts.
    """
    refuse_strong_dampers(scene)
    unit = scene.units.time
    if dt is not None:
        require(is_positive(dt), "dt", dt, f"{POSITIVE} [s]")
        legs, interval = scene.schedule(dt), METHODS["velocity-verlet"].interval
        refuse_unstable(scene, legs, interval, "velocity-verlet")
        _refuse_many(scene.end_time / dt, "a larger dt, or for a shorter end_time")
        return dt / unit
    if rtol is None:
        rtol = RTOL if scene.contact is None else _RTOL_OF_DAMPED
    allowed = (
        f"must be a number from {_FINEST:g} to 1: velocity Verlet takes too many steps for less"
    )
    require(is_positive(rtol) and _FINEST <= rtol < 1, "rtol", rtol, allowed)

    natural = _tried_step(scene, rtol) / unit
    digit = 10.0 ** (math.floor(math.log10(natural)) - 1)
    step = float(f"{math.floor(natural / digit) * digit:.2g}")
    _refuse_many(scene.end_time / unit / step, "a larger rtol, or for a dt")
    return step


def _refuse_many(steps: float, other: str) -> None:
    """Raise TooExpensive for more steps than a deck may take; ``other`` says what to do."""
    if steps > _MOST_STEPS:
        raise TooExpensive(
            f"this deck would take velocity Verlet {steps:.0e} steps, more than {_MOST_STEPS:.0e}:"
            f" ask for {other}"
        )


def _tried_step(scene: Scene, rtol: float) -> float:
    """Return the step for peaks of this accuracy, found by trials [s]."""

    def peaks_at(dt: float) -> FloatArray:
        if scene.contact is not None:
            return _verlet_peaks(scene, scene.schedule(dt))
        return Native("velocity-verlet", dt, peaks_only=True, wanted="all").run(scene).peak_force

    pilot = _PILOT_STEP * scene.contact_time
    longest = 2 * pilot
    if scene.contact is not None:
        longest = _UNSTABLE * stable_step(scene, METHODS["velocity-verlet"].interval)
        pilot = min(pilot, longest)
    # Trials never find a longer step, and may take hours themselves.
    _refuse_many(scene.end_time / longest, "a dt, or for a shorter end_time")
    if scene.contact is None:
        return step_for(peaks_at, pilot, rtol, SAFETIES["second order"])
    # Errors go as dt: the difference is the error of the shorter step. The deck's tolerance is
    # measured later.
    difference = largest_difference(peaks_at(pilot), peaks_at(pilot / 2))
    return min(pilot / 2 * _SHORTER * rtol / difference, longest) if difference > 0 else pilot


def lay_out(
    scene: Scene,
    dt: float | None = None,
    rtol: float | None = None,
    watch_every: int | None = None,
    **how: Any,
) -> Layout:
    """Return the layout of a deck; samples are by default 0.005 natural time units apart."""
    asked = Layout(math.nan, watch_every or 0, **how)  # refused before anything runs
    refuse_pair_style(scene, asked.pair_style)
    step = deck_step(scene, dt, rtol)
    _lost_digits(scene, step)
    if watch_every is None:
        interval = _LOOKING_INTERVAL * scene.contact_time / scene.units.time
        watch_every = max(1, math.floor(interval / step))
    return replace(asked, step=step, watch_every=watch_every)


def known_answer(scene: Scene, layout: Layout) -> KnownAnswer | None:
    """Return the true peaks and the errors by a deck's steps and samples; None without samples.

    Unpredictable for a deck whose tolerance would accept any peak.
    """
    if layout.watch_every == 0:
        return None
    whole = replace(scene, run=Run(scene.end_time))  # as the deck runs: to the latest default end
    truth = Native("reference", peaks_only=True, wanted="all").run(whole)
    if not np.any(truth.peak_force):
        allowed = "must be later: no contact is pressed before it"
        raise SceneError("run.end_time", scene.end_time, allowed)
    ratio = truth.peak_force / scene.units.force
    peaks, least = looked_at(scene, layout.step, layout.watch_every)
    off = np.maximum(np.abs(peaks - ratio), np.abs(least - ratio))
    if not scene.is_plain:
        off = off + ROUNDING * ratio * _made_of_rounding(scene, layout.step)
    # Contacts that are never pressed are not judged.
    error = off / np.where(ratio > 0, ratio, 1.0) + truth.error_estimate
    answer = KnownAnswer(ratio, error, _lost_digits(scene, layout.step))
    if ROOM * answer.largest_error >= 1:  # an error of 1 would accept a force of 0
        raise Unpredictable(
            f"this deck would judge nothing: steps of {layout.step * scene.units.time:.3g} s,"
            f" {layout.watch_every} from one look to the next, can miss whole peaks; take a smaller"
            " watch_every, rtol or dt, or a later end_time"
        )
    return answer


def looked_at(scene: Scene, step: float, watch_every: int) -> tuple[FloatArray, FloatArray]:
    """Return peaks of velocity Verlet over F0, and the least values that samples may give.

    Both have the shape (contacts,), a wall's contact the last; the step is in natural time units.
    The least force lies half an interval off a peak, or a whole interval before a peak at the end.
    """
    unit, granules = scene.units.time, scene.bodies
    legs = scene.schedule(step * unit)
    if scene.contact is not None:
        every = max(1, watch_every // _PHASES)
        # One more, because samples at the ends of legs are closer together.
        apart = watch_every if every == 1 else -(-watch_every // every) + 1
        sampled = looks_at_damped(scene, legs, every, apart)
        return np.maximum(_verlet_peaks(scene, legs), sampled.max(axis=0)), sampled.min(axis=0)
    walker = METHODS["velocity-verlet"].walker
    peaks = simulate(scene, legs, walker, leave_behind=True).peaks
    least = np.array(peaks.force)
    pressed = np.nonzero(np.isfinite(peaks.time))[0]
    interval = watch_every * max(leg.dt for leg in legs) / unit
    end = scene.end_time / unit
    before = np.maximum(interval / 2, interval - (end - peaks.time[pressed]))
    looks = np.concatenate([peaks.time[pressed] - before, peaks.time[pressed] + interval / 2])
    contacts = np.concatenate([pressed, pressed])
    order = np.argsort(looks)
    for some in np.array_split(order, -(-order.size * granules // _READINGS) or 1):
        recorder = Recorder(np.clip(looks[some], 0.0, end), granules, scene.wall is not None)
        simulate(scene, legs, walker, recorder)
        sampled = recorder.contact_force[np.arange(some.size), contacts[some]]
        np.minimum.at(least, contacts[some], sampled)
    return peaks.force, least


def looks_at_damped(scene: Scene, legs: Sequence[Leg], every: int, apart: int) -> FloatArray:
    """Return the largest forces over F0 in samples of velocity Verlet, shape (apart, contacts).

    Samples are ``every`` times ``apart`` steps apart. The first row has samples from the start of
    the run on, the next row samples that begin ``every`` steps later, and so on.
    """
    largest: FloatArray = np.zeros((apart, scene.granules.stiffness.size))
    done = 0
    for _, samples in samples_of(scene, legs, every=every):
        force = samples.contact_force[min(done, 1) :]  # the first was the last of the piece before
        for row in range(apart):
            seen = force[(row - done) % apart :: apart]
            np.maximum(largest[row], seen.max(axis=0, initial=0.0), out=largest[row])
        done += len(force)
    return largest


def _made_of_rounding(scene: Scene, step: float) -> FloatArray:
    """Return the relative change of the peaks by rounding errors of the coordinates, (contacts,).

    Repeated collisions amplify rounding errors. Granules are shifted at random at the start, as far
    as rounding at every step would move them, in several runs. A contact that changes less than the
    median gets the median.
    """
    units, granules = scene.units, scene.bodies
    legs = scene.schedule(step * units.time)
    rounded = float(np.finfo(np.float64).eps * scene.granules.position[-1]) / units.length
    size = rounded * math.sqrt(sum(leg.steps for leg in legs))
    peaks = _verlet_peaks(scene, legs)
    change, rng = np.zeros_like(peaks), np.random.default_rng(0)
    for _ in range(_SHIFTS):
        start = np.zeros((2, granules))
        start[0] = size * rng.standard_normal(granules)
        shifted = _verlet_peaks(scene, legs, start)
        change = np.maximum(change, np.abs(shifted - peaks))
    pressed = judged_contacts(peaks)
    relative = np.where(pressed, change / np.where(pressed, peaks, 1.0), 0.0)
    return np.maximum(relative, float(np.median(relative[pressed])))


def _verlet_peaks(scene: Scene, legs: Sequence[Leg], start: FloatArray | None = None) -> FloatArray:
    """Return peaks of velocity Verlet over F0 with shifts added at the start, shape (contacts,)."""
    if scene.contact is not None:
        run = simulate_damped_verlet(scene, legs, start=start)
    else:
        run = simulate(scene, legs, METHODS["velocity-verlet"].walker, start=start)
    return np.asarray(run.peaks.force)


def lammps_deck(scene: Scene, dt: float | None, rtol: float | None, title: str, **how: Any) -> str:
    """Return a deck for LAMMPS that finds the peaks of a scene and compares them with true ones.

    ``how`` has the sampling interval and the keywords of ``Layout``.
    """
    scene = with_end(scene)
    layout = lay_out(scene, dt, rtol, title=title, **how)
    return deck.deck(scene, layout, known_answer(scene, layout))


def program_deck(
    engine: str, scene: Scene, dt: float | None, rtol: float | None, title: str
) -> str:
    """Return a deck for LIGGGHTS or Yade that finds the peaks of a scene.

    RunFailed for a scene that the engine cannot simulate.
    """
    writer = ENGINES[engine].make()
    assert isinstance(writer, ProgramEngine)
    scene = with_end(scene)
    writer.refuse(scene)
    step = deck_step(scene, dt, rtol)
    _lost_digits(scene, step)
    legs, scaling = similar(scene, step)
    steps, longest = sum(leg.steps for leg in legs), max(leg.dt for leg in legs)
    elastic = " elastic" if scene.contact is None else ""
    which = f"with {' and '.join(scene.terms)}" if scene.terms else "pushed at one end"
    chain = f"a chain of {scene.chain.granules}{elastic} spheres in Hertz contact"
    about = [
        f"{deck.plain(title)}: {chain}, {which}.",
        f"Written by hertzchain {version('hertzchain')}. SI units throughout.",
        f"{steps} steps of at most {longest:.4g} s, ending at the corners of the shock.",
        "It prints the peak force of each contact, and writes them to peaks.csv. To judge them:",
        "hertzchain judge SCENE peaks.csv",
        *textwrap.wrap(deck.what_is_softer(scaling), 96),
    ]
    text: str = writer.WRITER.deck(scaling.scene(scene), legs, about)
    return text


def _lost_digits(scene: Scene, step: float) -> float:
    """Return the relative error of the peaks by coordinates; Unpredictable if it is too large."""
    legs, scaling = similar(scene, step)
    lost = predicted_loss(scene, sum(leg.steps for leg in legs), scaling)
    if lost > _MOST_LOST:
        raise Unpredictable(
            f"coordinates would cost the peaks of this scene about {lost:.0e}, even in a deck of"
            " softer granules: take a shorter chain, a longer step or native"
        )
    return lost
