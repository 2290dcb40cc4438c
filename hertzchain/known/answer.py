"""Scenes with an expected answer: decks for LAMMPS that judge themselves."""

from __future__ import annotations

import itertools
import math
import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.accuracy import NONE, Softening, predicted_loss, softening
from hertzchain.engines.external.engine import ProgramEngine
from hertzchain.engines.external.terms import wall_position
from hertzchain.engines.lammps.deck import chain, leg_commands, refuse_pair_style, start
from hertzchain.engines.lammps.dialect import NO_STEP, oldest
from hertzchain.engines.native.backend import Native, by_velocity_verlet, with_end
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

WANTED = 1e-6  # relative error by absolute coordinates up to which a deck has the true chain
ROOM = 1.1  # tolerance over the measured error: other intervals shift the samples
ROUNDING = 3  # factor on the estimated round-off (not a bound); measured in the gallery: 0.2


@dataclass(frozen=True, eq=False)
class KnownAnswer:
    """The peaks that a deck has to find, and their errors with its step and interval."""

    force_ratio: FloatArray  # true peak forces over F0, shape (contacts,)
    # relative error of velocity Verlet with the deck's step and interval, (contacts,)
    error: FloatArray
    lost: float = 0.0  # estimated relative error of the peaks by coordinates

    @property
    def allowed(self) -> FloatArray:
        """Tolerance of each peak, a relative error, shape (contacts,)."""
        return ROOM * self.error + ROUNDING * self.lost

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Contacts that are judged: pressed enough, and not affected by the end of the run."""
        pressed = judged_contacts(self.force_ratio)
        # Error of a contact above which it is not judged, if others have less
        most = max(1e-3, 10 * float(np.median(self.error[pressed])))
        return np.logical_and(pressed, self.error <= most)

    @property
    def largest_error(self) -> float:
        """Largest error of the judged contacts."""
        return float(np.max(self.error[self.judged]))


@dataclass(frozen=True)
class Layout:
    """Options of a deck that do not change the motion. A SceneError names an impossible one."""

    step: float  # the largest, natural time units
    watch_every: int  # steps between two samples of the overlaps
    pair_style: str = "granular"  # or gran/hertz/history
    title: str = "a scene"  # title in the deck
    name: str = "THIS_FILE"  # name of the deck in its example commands

    def __post_init__(self) -> None:
        require(self.watch_every >= 1, "watch_every", self.watch_every, "must be at least 1")


def plain(title: str) -> str:
    """Return a title without signs that could end a comment of LAMMPS, Python or YAML."""
    return re.sub(r"[^\w .,:()+=-]", "_", title)


def comment(text: str) -> list[str]:
    """Return text as lines of comment."""
    return textwrap.wrap(text, 98, initial_indent="# ", subsequent_indent="# ")


def similar(scene: Scene, step: float) -> tuple[list[Leg], Softening, float]:
    """Return the legs of a deck, its relation to the scene, and what coordinates cost the peaks.

    The deck's chain is softer if that saves many digits; the legs are those of that chain. The step
    is in natural time units. Unpredictable where the peaks lose too many digits all the same.
    """
    legs = scene.schedule(step * scene.units.time)
    steps = sum(leg.steps for leg in legs)
    scaling = softening(scene, steps)
    if scaling.power >= 0 and predicted_loss(scene, steps) <= WANTED:
        scaling = NONE
    lost = predicted_loss(scene, steps, scaling)
    if lost > _MOST_LOST:
        raise Unpredictable(
            f"coordinates would cost the peaks of this scene about {lost:.0e}, even in a deck of"
            " softer granules: take a shorter chain, a longer step or native"
        )
    return [scaling.leg(leg) for leg in legs], scaling, lost


def what_is_softer(scaling: Softening) -> str:
    """Return the difference of a deck's chain from that of its scene, in words; "" for NONE."""
    if (k := scaling.power) == NONE.power:
        return ""
    return (
        "Coordinates of whole granules leave few digits to overlaps as small as those of this"
        f" scene. The deck has E / 8^{k}: overlaps and displacements are 4^{k} times and all times"
        f" 2^{k} times those of the scene; forces are the same."
    )


def deck(scene: Scene, layout: Layout, answer: KnownAnswer) -> str:
    """Return a deck for ``lmp -in FILE``, on any processors."""
    refuse_pair_style(scene, layout.pair_style)
    legs, scaling, _ = similar(scene, layout.step)
    softer = scaling.scene(scene)
    numbers = _Numbers(softer, answer)
    sections = [
        _header(scene, layout, answer, sum(leg.steps for leg in legs), scaling),
        [
            "# ---- Parameters",
            f"variable watch index {layout.watch_every} # steps between two looks",
            "variable peaks index peaks.csv # where the peak forces go",
        ],
        [
            "# ---- The granules, shared out among processors along the chain",
            *start(scene),
            "processors * 1 1",
            "",
            *chain(softer, layout.pair_style),
            "thermo 0",
            "# A step is so short that taking the time of its parts would cost a fifth of it.",
            "timer off",
        ],
        numbers.commands(),
        _watch(softer, numbers),
        _run(scene, legs),
        [*_peaks(softer), "", *_verdict(softer, layout, answer, numbers)],
    ]
    return "\n\n".join("\n".join(lines) for lines in sections) + "\n"


def _about(scene: Scene, title: str) -> str:
    """Return the title of a deck and the chain that it has, in words."""
    elastic = " elastic" if scene.contact is None else ""
    which = f"with {' and '.join(scene.terms)}" if scene.terms else "pushed at one end"
    chain = f"a chain of {scene.chain.granules}{elastic} spheres in Hertz contact"
    return f"{plain(title)}: {chain}, {which}."


def _header(
    scene: Scene, layout: Layout, answer: KnownAnswer, steps: int, scaling: Softening
) -> list[str]:
    run = f"lmp -in {plain(layout.name)}"
    wall = ""
    if scene.wall is not None:
        wall = f" Contact {scene.last_contact}, on the screen, is the wall's."
    if scene.near_wall is not None:
        wall += " Contact 1 is the near wall's, for which fixed granule 1 stands here."
    damped = ", damping included" if scene.contact is not None else ""
    ratio = [f"{value:.4f}" for value in answer.force_ratio]
    shown = ratio if len(ratio) <= 3 else [*ratio[:3], "...", ratio[-1]]
    results = (
        f"{what_is_softer(scaling)} The peak force of each contact goes to peaks.csv; contact i"
        f" lies between granules i - 1 and i.{wall} Peaks are total forces{damped}. Over F0,"
        f" {scene.units.force:.6g} N, they are expected to be {', '.join(shown)}, right to"
        f" {answer.largest_error:.1e}. The end says PASS, FAIL (exit status 1) or NOT CHECKED (3)."
        " Only watch, peaks can be changed by -var. Have another deck written for another scene."
    )
    return [
        *comment(
            f"{_about(scene, layout.title)} Written by hertzchain {version('hertzchain')} for"
            f" LAMMPS of {oldest(scene)[1]} and later. SI units throughout."
        ),
        "#",
        f"#   {run}                 {steps} steps",
        f"#   mpiexec -n 2 {run}    on two processors, the same result",
        f"#   {run} -var watch 1    a look at every step",
        "#",
        *comment(results.lstrip()),
    ]


class _Numbers:
    """Known numbers of each granule, in the columns ``f_known[1]`` and so on."""

    def __init__(self, scene: Scene, answer: KnownAnswer) -> None:
        each, last = scene.granules, 0.0
        if scene.wall is not None:
            last = each.radius[-1] - wall_position(scene)
        columns = {
            "reach": np.append(each.radius[:-1] + each.radius[1:], last),
            "stiffness": np.append(each.stiffness, 0.0),
        }
        if each.damping is not None:
            columns["damping"] = np.append(each.damping, 0.0)
        # Digits that are the same on every machine.
        ratio = [f"{x:.12g}" for x in np.where(answer.judged, answer.force_ratio, 0.0)]
        allowed = [f"{x:.3g}" for x in answer.allowed]
        columns["true"] = np.array([*map(float, ratio), 0.0])
        columns["allowed"] = np.array([*map(float, allowed), 1.0])
        self._scene = scene
        self._columns = {name: values[: scene.bodies] for name, values in columns.items()}

    def name(self, column: str) -> str:
        """Return the name of a column in formulas."""
        return f"f_known[{list(self._columns).index(column) + 1}]"

    @property
    def overlap(self) -> str:
        """LAMMPS formula of the overlap between a granule and the next one, or the wall [m]."""
        # The place of the next granule is 0 for the last granule.
        overlap = f"{self.name('reach')}+x-c_ahead"
        return overlap if self._scene.wall else f"(id<{self._scene.bodies})*({overlap})"

    @property
    def force(self) -> str:
        """LAMMPS formula of the force of a contact [N], from ``touching`` and ``rate``."""
        contact, elastic = self._scene.contact, f"{self.name('stiffness')}*v_touching^1.5"
        if contact is None:
            return elastic
        power = {0.0: "(v_touching>0)", 0.25: "v_touching^0.25", 0.5: "sqrt(v_touching)"}
        return f"{elastic}+{self.name('damping')}*{power[contact.exponent]}*v_rate"

    def commands(self) -> list[str]:
        """Return the commands that store the known numbers of each granule."""
        contact, reach, damping = self._scene.contact, "its radius and the next one's [m]", ""
        if self._scene.wall is not None:
            reach += " (the last: its radius less the wall's place)"
        if contact is not None:
            q = contact.exponent
            damping = f"; damping c in A overlap^(3/2) + c overlap^{q:g} rate [N s m^-{1 + q:g}]"
        names = [f"v_known_{name}" for name in self._columns]
        return [
            "# ---- What is known of each granule and of its contact with the next",
            *comment(
                f"reach: {reach}; stiffness A in F = A overlap^(3/2) [N/m^1.5]{damping}; the true"
                " peak force over F0, 0 if it is not judged, and the relative error allowed: what"
                " step and looks cost it, and coordinates may. None of these is from this LAMMPS."
            ),
            *(
                line
                for name, values in self._columns.items()
                for line in _by_granule(f"known_{name}", values)
            ),
            f"fix known all store/state 0 {' '.join(names)}",
            NO_STEP,
        ]


def _by_granule(name: str, values: FloatArray) -> list[str]:
    """Return a variable with a value in each granule; ``set`` would print three lines each."""
    terms, last = [], 0
    for value, alike in itertools.groupby(values.tolist()):
        first, last = last + 1, last + len(list(alike))
        where = f"(id=={first})" if first == last else f"(id>={first})*(id<={last})"
        terms.append(f"+{where}*{value!r}")
    *lines, end = textwrap.wrap(" ".join(terms), 92, break_on_hyphens=False)
    return [f'variable {name} atom "0 &', *(f"    {line} &" for line in lines), f'    {end}"']


def _watch(scene: Scene, numbers: _Numbers) -> list[str]:
    """Return the commands that keep the largest force of each contact."""
    rate = []
    if scene.contact is not None:
        rate = [
            "# Velocities in the same way: damping makes the force depend on the overlap's rate.",
            "compute speed all property/atom vx",
            "compute speeds all reduce/chunk each sum c_speed",
            "compute speed_ahead all global/atom v_next c_speeds",
            "variable rate atom vx-c_speed_ahead",
        ]
    return [
        "# ---- Watching: the largest force of each contact, kept by the granule behind it",
        "# Each granule is a chunk of its own, so that the sum over it is its position; of these",
        "# each granule gets the one of the next.",
        "variable id atom id",
        "variable next atom id+1",
        "compute position all property/atom x",
        "compute each all chunk/atom v_id nchunk once ids once",
        "compute positions all reduce/chunk each sum c_position",
        "compute ahead all global/atom v_next c_positions",
        f"variable overlap atom {numbers.overlap}",
        *rate,
        "variable touching atom v_overlap*(v_overlap>0)",
        f"variable total atom {numbers.force}",
        "variable larger atom f_largest*(f_largest>v_total)+v_total*(f_largest<=v_total)",
        "# fix store/state keeps what it stored last, f_largest, but does not make LAMMPS compute",
        "# positions again at each look; the fix before it, an average of nothing, does.",
        "variable nothing equal 0",
        "fix look all ave/time ${watch} 1 ${watch} v_nothing",
        "fix largest all store/state ${watch} v_larger",
    ]


def _run(scene: Scene, legs: list[Leg]) -> list[str]:
    """Return the commands that run leg after leg, each in equal steps."""
    lines = ["# ---- The run: steps end at the corners of the shock, and are equal between them"]
    for before, leg in zip([None, *legs], legs, strict=False):
        what = "No applied force"
        if (ramp := leg.ramp) is not None:
            what = f"From {ramp.start_force:g} N to {ramp.end_force:g} N ({ramp.shape})"
        if leg.stroke is not None:
            what = f"The piston moves at {leg.stroke.velocity:g} m/s"
        lines += ["", f"# {what}", *leg_commands(scene, leg, before), f"run {leg.steps} post no"]
    return lines


def _peaks(scene: Scene) -> list[str]:
    """Return the commands that keep and write the peaks."""
    return [
        "# ---- The answer: the largest forces",
        "fix answers all property/atom d_force",
        "variable peak atom f_largest",
        "set group all d_force v_peak",
        "unfix largest",
        "compute peak all property/atom d_force",
        f"variable contact atom {'id' if scene.near_wall is not None else 'id+1'}",
        f"group behind id < {len(scene.contacts) + 1}",
        'print "contact,peak_force_N" file ${peaks}',
        "write_dump behind custom ${peaks} v_contact d_force modify append yes header no sort id &",
        '    format line "%.0f, %.17g"',
    ]


def _verdict(scene: Scene, layout: Layout, answer: KnownAnswer, numbers: _Numbers) -> list[str]:
    """Return the commands that compare the peaks with the true ones, and print the verdict."""
    true, allowed = numbers.name("true"), numbers.name("allowed")
    wall, column, on_wall = [], "", []
    if scene.wall is not None:
        wall, column = ["compute on_wall last reduce max c_peak"], " c_on_wall"
        on_wall = ['print "Peak force on the wall: $(c_on_wall:%.10g) N"']
    at_worst, right = "(v_contact==v_where)", int(np.sum(answer.judged))
    return [
        f"variable found atom c_peak/{scene.units.force!r}",
        f"variable off atom ({true}>0)*abs(v_found/({true}+({true}==0))-1)",
        f"variable share atom v_off/{allowed}",
        "compute worst all reduce max v_share",
        "variable worst equal c_worst",
        f"variable at atom v_contact*({true}>0)*(v_share>=v_worst*(1-1e-12))",
        "compute where all reduce max v_at",
        "variable where equal c_where",
        f"variable expected atom {true}*{at_worst}",
        f"variable there atom v_found*{at_worst}",
        f"variable limit atom {allowed}*{at_worst}",
        "compute shown all reduce max v_expected v_there v_limit",
        f"variable good atom ({true}>0)*(v_off<={allowed})",
        "compute good all reduce sum v_good",
        *wall,
        f"thermo_style custom step c_worst c_where c_shown[1] c_shown[2] c_shown[3] c_good{column}",
        NO_STEP,
        "",
        'print ""',
        *on_wall,
        f'if "${{watch}} > {layout.watch_every}" then &',
        f'    "print \'NOT CHECKED: watch is above {layout.watch_every}\'" "quit 3"',
        (
            'print "Peak forces over F0, contact $(v_where:%.0f), the nearest to its tolerance,'
            ' or the furthest beyond it:"'
        ),
        'print "  expected    $(c_shown[1]:%.10f)"',
        'print "  found       $(c_shown[2]:%.10f)"',
        'print "  difference  $(abs(c_shown[2]/c_shown[1]-1):%.1e)"',
        'print "  tolerance   $(c_shown[3]:%.1e)"',
        f'if "$(c_good) == {right}" then "print PASS" else "print FAIL" "quit 1"',
    ]


_MOST_LOST = 3e-5  # largest relative error of the peaks by coordinates, of softer granules (chosen)
_MOST_STEPS = 1e7  # most steps of a deck: minutes of LAMMPS with 60 granules
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
        # Default relative error, damped: errors go as dt, and 1e-6 takes hours
        rtol = RTOL if scene.contact is None else 1e-4
    finest = 1e-9  # needs three million steps
    allowed = (
        f"must be a number from {finest:g} to 1: velocity Verlet takes too many steps for less"
    )
    require(is_positive(rtol) and finest <= rtol < 1, "rtol", rtol, allowed)
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
        return _verlet_peaks(scene, scene.schedule(dt))

    # Step of the first run in the search for a wanted error [natural time units]
    pilot = 0.04 * scene.contact_time
    longest = 2 * pilot
    if scene.contact is not None:
        # Largest fraction of the longest stable step, damped (chosen)
        longest = 0.5 * stable_step(scene, METHODS["velocity-verlet"].interval)
        pilot = min(pilot, longest)
    # Trials never find a longer step, and may take hours themselves.
    _refuse_many(scene.end_time / longest, "a dt, or for a shorter end_time")
    if scene.contact is None:
        return step_for(peaks_at, pilot, rtol, SAFETIES["smooth"])
    # Errors go as dt: the difference is the error of the shorter step. The deck's tolerance is
    # measured later.
    difference = largest_difference(peaks_at(pilot), peaks_at(pilot / 2))
    # Fraction of the step found by trials, damped: sampling costs some accuracy (chosen)
    return min(pilot / 2 * 0.7 * rtol / difference, longest) if difference > 0 else pilot


def lay_out(
    scene: Scene,
    dt: float | None = None,
    rtol: float | None = None,
    watch_every: int | None = None,
    **how: Any,
) -> Layout:
    """Return the layout of a deck; samples are by default 0.005 natural time units apart."""
    asked = Layout(math.nan, 1 if watch_every is None else watch_every, **how)  # refused at once
    refuse_pair_style(scene, asked.pair_style)
    step = deck_step(scene, dt, rtol)
    similar(scene, step)  # refused before the peaks are computed
    if watch_every is None:
        # Natural time units between two samples: costs the peaks 5e-6
        interval = 0.005 * scene.contact_time / scene.units.time
        watch_every = max(1, math.floor(interval / step))
    return replace(asked, step=step, watch_every=watch_every)


def known_answer(scene: Scene, layout: Layout) -> KnownAnswer:
    """Return the true peaks and the errors by a deck's steps and samples.

    Unpredictable for a deck whose tolerance would accept any peak.
    """
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
    answer = KnownAnswer(ratio, error, similar(scene, layout.step)[2])
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
        # Least number of tried offsets of the samples, damped (chosen)
        every = max(1, watch_every // 4)
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
    from hertzchain.engines.native.verlet import samples_of

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

    Repeated collisions amplify rounding errors: granules start shifted at random, as far as
    rounding at every step moves them. A contact that changes less than the median gets the median.
    """
    units, granules = scene.units, scene.bodies
    legs = scene.schedule(step * units.time)
    rounded = float(np.finfo(np.float64).eps * scene.granules.position[-1]) / units.length
    size = rounded * math.sqrt(sum(leg.steps for leg in legs))
    peaks = _verlet_peaks(scene, legs)
    change, rng = np.zeros_like(peaks), np.random.default_rng(0)
    # Number of random starts that measure the amplification of rounding (chosen)
    for _ in range(4):
        start = np.zeros((2, granules))
        start[0] = size * rng.standard_normal(granules)
        shifted = _verlet_peaks(scene, legs, start)
        change = np.maximum(change, np.abs(shifted - peaks))
    pressed = judged_contacts(peaks)
    relative = np.where(pressed, change / np.where(pressed, peaks, 1.0), 0.0)
    return np.maximum(relative, float(np.median(relative[pressed])))


def _verlet_peaks(scene: Scene, legs: Sequence[Leg], start: FloatArray | None = None) -> FloatArray:
    """Return peaks of velocity Verlet over F0 with shifts added at the start, shape (contacts,)."""
    return np.asarray(by_velocity_verlet(scene, legs, start=start).peaks.force)


def lammps_deck(scene: Scene, dt: float | None, rtol: float | None, title: str, **how: Any) -> str:
    """Return a deck for LAMMPS that judges its peaks; ``how`` are the keywords of ``lay_out``."""
    scene = with_end(scene)
    layout = lay_out(scene, dt, rtol, title=title, **how)
    return deck(scene, layout, known_answer(scene, layout))


def program_deck(
    engine: str, scene: Scene, dt: float | None, rtol: float | None, title: str
) -> str:
    """Return a deck for LIGGGHTS or Yade that finds the peaks of a scene, if it can run that."""
    writer = ENGINES[engine].make()
    assert isinstance(writer, ProgramEngine)
    scene = with_end(scene)
    writer.refuse(scene)
    step = deck_step(scene, dt, rtol)
    legs, scaling, _ = similar(scene, step)
    steps, longest = sum(leg.steps for leg in legs), max(leg.dt for leg in legs)
    about = [
        _about(scene, title),
        f"Written by hertzchain {version('hertzchain')}. SI units throughout.",
        f"{steps} steps of at most {longest:.4g} s, ending at the corners of the shock.",
        "It prints the peak force of each contact, and writes them to peaks.csv. To judge them:",
        "hertzchain judge SCENE peaks.csv",
        *textwrap.wrap(what_is_softer(scaling), 96),
    ]
    text: str = writer.WRITER.deck(scaling.scene(scene), legs, about)
    return text
