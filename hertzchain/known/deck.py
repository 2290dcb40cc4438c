"""A scene as one LAMMPS deck that runs, and judges itself, without Python: pure text.

It is the deck of the LAMMPS engine with additions: known numbers of each granule, none of them from
LAMMPS, samples of the contact forces, and a verdict. Where coordinates would lose digits, the deck
has a softer, similar chain.
"""

from __future__ import annotations

import itertools
import re
import textwrap
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.rescaling import NONE, Softening, predicted_loss, softening
from hertzchain.engines.external.terms import wall_position
from hertzchain.engines.lammps.deck import chain, leg_commands, refuse_pair_style, start
from hertzchain.engines.lammps.dialect import NO_STEP, OLDEST, oldest, write_dump
from hertzchain.errors import SceneError, require
from hertzchain.observables.peaks import judged_contacts
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

WANTED = 1e-6  # relative error by absolute coordinates up to which a deck has the true chain
ROOM = 1.1  # tolerance over the measured error: other intervals shift the samples
ROUNDING = 3  # factor on the estimate of round-off, which is no bound; measured in the gallery: 0.2
UNCLEAR = 1e-3  # error of a contact above which it is not judged, if others have less


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
        most = max(UNCLEAR, 10 * float(np.median(self.error[pressed])))
        return np.logical_and(pressed, self.error <= most)

    @property
    def largest_error(self) -> float:
        """Largest error of the judged contacts."""
        return float(np.max(self.error[self.judged]))


@dataclass(frozen=True)
class Layout:
    """Options of a deck that do not change the motion. A SceneError names an impossible one."""

    step: float  # the largest, natural time units
    watch_every: int  # steps between two samples of the overlaps; 0: a lean deck
    pair_style: str = "granular"  # or gran/hertz/history
    dump_every: int = 0  # steps between two states for OVITO; 0: none
    title: str = "a scene"  # title in the deck
    name: str = "THIS_FILE"  # name of the deck in its example commands

    def __post_init__(self) -> None:
        for key, value in (("watch_every", self.watch_every), ("dump_every", self.dump_every)):
            require(value >= 0, key, value, "must be a number of steps, 0 for never")


def plain(title: str) -> str:
    """Return a title without signs that could end a comment of LAMMPS, Python or YAML."""
    return re.sub(r"[^\w .,:()+=-]", "_", title)


def comment(text: str) -> list[str]:
    """Return text as lines of comment."""
    return textwrap.wrap(text, 98, initial_indent="# ", subsequent_indent="# ")


def similar(scene: Scene, step: float) -> tuple[list[Leg], Softening]:
    """Return the legs of a deck, and its relation to the scene: softer if that saves many digits.

    The step is in natural time units; the legs are those of the similar scene.
    """
    legs = scene.schedule(step * scene.units.time)
    steps = sum(leg.steps for leg in legs)
    scaling = softening(scene, steps)
    if scaling.power >= 0 and predicted_loss(scene, steps) <= WANTED:
        scaling = NONE
    return [scaling.leg(leg) for leg in legs], scaling


def what_is_softer(scaling: Softening) -> str:
    """Return the difference of a deck's chain from that of its scene, in words; "" for NONE."""
    if (k := scaling.power) == NONE.power:
        return ""
    return (
        "Coordinates of whole granules leave few digits to overlaps as small as those of this"
        f" scene. The deck has E / 8^{k}: overlaps and displacements are 4^{k} times and all times"
        f" 2^{k} times those of the scene; forces are the same."
    )


def deck(scene: Scene, layout: Layout, answer: KnownAnswer | None = None) -> str:
    """Return a deck for ``lmp -in FILE``, on any processors; ``answer`` is None for lean decks.

    RunFailed for a layout that is impossible with terms.
    """
    if (answer is None) != (layout.watch_every == 0):
        raise SceneError("watch_every", layout.watch_every, "must be 0 where no peaks are known")
    refuse_pair_style(scene, layout.pair_style)
    legs, scaling = similar(scene, layout.step)
    softer, every = scaling.scene(scene), layout.dump_every
    options, trajectory, watch = [], [], []
    after = [write_dump("chain.final", ("x", "vx", "fx"))]
    if answer is not None:
        options = [
            f"variable watch index {layout.watch_every} # steps between two looks",
            "variable peaks index peaks.csv # where the peak forces go",
        ]
        numbers = _Numbers(softer, answer)
        watch = [numbers.commands(), _watch(softer, numbers)]
        after = [*_peaks(softer), "", *_verdict(softer, layout, answer, numbers)]
    if every:
        options += [
            f"variable dump_every index {every} # steps between two states for OVITO",
            "variable trajectory index chain.lammpstrj",
        ]
        trajectory = [
            "# ---- For OVITO",
            "dump states all custom ${dump_every} ${trajectory} id type x y z radius vx fx",
            "dump_modify states sort id",
        ]
    sections = [
        _header(scene, layout, answer, sum(leg.steps for leg in legs), scaling),
        ["# ---- Parameters", *options] if options else [],
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
        *watch,
        trajectory,
        _run(scene, legs),
        after,
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def _header(
    scene: Scene, layout: Layout, answer: KnownAnswer | None, steps: int, scaling: Softening
) -> list[str]:
    run = f"lmp -in {plain(layout.name)}"
    terms, needed = scene.terms, oldest(scene)
    elastic = " elastic" if scene.contact is None else ""
    which = f"with {' and '.join(terms)}" if terms else "pushed at one end"
    changed = ["watch", "peaks"] if answer is not None else []
    changed += ["dump_every", "trajectory"] if layout.dump_every else []
    fixed = "Have another deck written for another scene."
    if changed:
        fixed = f"Only {', '.join(changed)} can be changed by -var. {fixed}"
    if answer is None:
        fixed += " Nothing checks here what -var of another name changes."
    return [
        *comment(
            f"{plain(layout.title)}: a chain of {scene.chain.granules}{elastic} spheres in Hertz"
            f" contact, {which}. Written by hertzchain {version('hertzchain')} for LAMMPS of"
            f" {OLDEST if needed is None else needed[1]} and later. SI units throughout."
        ),
        "#",
        f"#   {run}                 {steps} steps",
        f"#   mpiexec -n 2 {run}    on two processors, the same result",
        *([] if answer is None else [f"#   {run} -var watch 1    a look at every step"]),
        "#",
        *comment(" ".join([what_is_softer(scaling), _expected(scene, answer), fixed]).lstrip()),
    ]


def _expected(scene: Scene, answer: KnownAnswer | None) -> str:
    """Return the results of the deck, in words."""
    if answer is None:
        return (
            "Peak forces are not watched. The final state goes to chain.final: id, x [m], vx [m/s],"
            " fx [N]."
        )
    wall = ""
    if scene.wall is not None:
        wall = f" Contact {scene.last_contact}, on the screen, is the wall's."
    if scene.near_wall is not None:
        wall += " Contact 1 is the near wall's, for which fixed granule 1 stands here."
    damped = ", damping included" if scene.contact is not None else ""
    ratio = [f"{value:.4f}" for value in answer.force_ratio]
    shown = ratio if len(ratio) <= 3 else [*ratio[:3], "...", ratio[-1]]
    return (
        "The peak force of each contact goes to peaks.csv; contact i lies between granules i - 1"
        f" and i.{wall} Peaks are total forces{damped}. Over F0, {_name_of_unit(scene)}"
        f" ({scene.units.force:.6g} N), they are expected to be {', '.join(shown)}, right to"
        f" {answer.largest_error:.1e}. The end says PASS, FAIL (exit status 1) or NOT CHECKED (3)."
    )


def _name_of_unit(scene: Scene) -> str:
    """Return the name of the unit of force of a scene."""
    static = 0.0 if scene.precompression is None else float(np.max(scene.granules.static_force))
    if scene.units.force == scene.force_at_start:
        return "the peak force of the hardest contact of granules that move at the start, alone"
    if scene.units.force > max(scene.peak_force, static):
        return "the force of a chain that the piston presses against the wall as far as it goes"
    if scene.units.force > scene.peak_force:
        return "the largest static force"
    if scene.piston is not None:
        return "the peak force of granule 2 alone, hit with the largest velocity of the piston"
    if scene.striker is not None:
        return "the peak force of the striker's contact alone"
    return "the largest applied force"


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
        """LAMMPS formula of the overlap between a granule and the next one, or the wall [m].

        The place of the next granule is 0 for the last granule.
        """
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
    """Return a variable with a value in each granule.

    A ``set`` for each granule would print three lines each, and hide the verdict among them.
    """
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
        'print "Peak forces over F0, contact $(v_where:%.0f), the nearest to its tolerance:"',
        'print "  expected    $(c_shown[1]:%.10f)"',
        'print "  found       $(c_shown[2]:%.10f)"',
        'print "  difference  $(abs(c_shown[2]/c_shown[1]-1):%.1e)"',
        'print "  tolerance   $(c_shown[3]:%.1e)"',
        f'if "$(c_good) == {right}" then "print PASS" else "print FAIL" "quit 1"',
    ]
