"""A scene with terms as one LAMMPS deck that runs, and judges itself, without Python: pure text.

Every granule stands in it with its own size, material and place. Nothing but steps and looks can be
changed with ``-var``: no similarity keeps the peaks of such a scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from hertzchain.arrays import FloatArray
from hertzchain.decks import standalone_run
from hertzchain.decks.layout import KnownAnswer, Layout
from hertzchain.decks.standalone_run import Piece, comment
from hertzchain.engines.external.rescaling import predicted_loss
from hertzchain.engines.external.terms import wall_position
from hertzchain.engines.lammps import terms_deck
from hertzchain.engines.lammps.deck import MOTION, START, force_formula
from hertzchain.engines.lammps.dialect import NO_STEP, OLDEST, write_dump
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg

_PRESSED_MORE = 8.0
"""Largest over smallest force of the contacts under which the law is checked (chosen)."""


def deck(scene: Scene, layout: Layout, known: KnownAnswer | None) -> str:
    """The text of a deck for ``lmp -in FILE``; ``known`` is None for a lean one.

    RunFailed for a layout that a scene with terms cannot have.
    """
    check(scene, layout)
    steps = sum(leg.steps for leg in scene.schedule(layout.step * scene.units.time))
    sections = [
        _header(scene, layout, known, steps),
        _parameters(scene, layout),
        [
            "# ---- The granules, shared out among processors along the chain",
            *START,
            "processors * 1 1",
            "",
            *terms_deck.granules(scene, layout.pair_style),
            "",
            *MOTION,
            "thermo 0",
            "# A step is so short that taking the time of its parts would cost a fifth of it.",
            "timer off",
            "",
            "# ---- What holds and pushes them all the time",
            *terms_deck.held(scene),
        ],
        *([] if known is None else [_law(scene), standalone_run.watch_commands(_overlap(scene))]),
        standalone_run.trajectory_commands(layout),
        [
            "# ---- The run",
            *standalone_run.leg_commands(
                [_piece(leg) for leg in scene.schedule(layout.step * scene.units.time)]
            ),
        ],
        [write_dump("chain.final", ("x", "vx", "fx"))]
        if known is None
        else _verdict(scene, layout, known, steps),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def check(scene: Scene, layout: Layout) -> None:
    """Raise RunFailed for a layout that a scene with terms cannot have."""
    terms_deck.check_pair_style(scene, layout.pair_style)
    if layout.atoms != "create":
        raise RunFailed(
            f"a data file holds equal granules that touch, not {' and '.join(scene.terms)}: leave"
            " out --atoms data, the deck names every granule"
        )


def _header(scene: Scene, layout: Layout, known: KnownAnswer | None, steps: int) -> list[str]:
    run = f"lmp -in {layout.name}"
    granules, *terms = scene.chain.granules, *scene.terms
    listed = ", ".join(terms[:-1]) + " and " + terms[-1] if len(terms) > 1 else terms[0]
    what = (
        f"{layout.title}: a chain of {granules} elastic spheres in Hertz contact, with {listed}."
        f" Written by hertzchain {version('hertzchain')} for LAMMPS of {OLDEST} and later. SI units"
        " throughout."
    )
    lines = [
        *comment(what),
        "#",
        f"#   {run}                 {steps} steps",
        f"#   mpiexec -n 2 {run}    on two processors, the same result",
        *([] if known is None else [f"#   {run} -var watch 1    a look at every step"]),
        "#",
    ]
    fixed = "Granules and loads are fixed: have another deck written for others."
    if known is None:
        text = (
            "Peak forces are not watched. The final state goes to chain.final: id, x [m], vx [m/s],"
            f" fx [N]. {fixed}"
        )
        return [*lines, *comment(text)]
    of_wall = (
        "" if scene.wall is None else f" Contact {granules + 1}, on the screen, is the wall's."
    )
    first = ", ".join(f"{value:.4f}" for value in known.force_ratio[:3])
    last = f", ..., {known.force_ratio[-1]:.4f}" if known.force_ratio.size > 3 else ""
    expected = (
        "The peak force of each contact goes to peaks.csv; contact i lies between granules i - 1"
        f" and i.{of_wall} Peaks are total forces, static loads included. Over F0, {_unit(scene)},"
        f" they are expected to be {first}{last}, right to {known.largest_error:.1e}. The last line"
        " says PASS or FAIL (exit status 1); NOT CHECKED after longer steps or rarer looks."
        f" {fixed}"
    )
    return [*lines, *comment(expected)]


def _unit(scene: Scene) -> str:
    """The name of the unit of force of a scene."""
    if scene.units.force > scene.peak_force:
        return "the largest static force"
    if scene.striker is not None:
        return "the peak force of the striker's contact alone"
    return "the largest applied force"


def _parameters(scene: Scene, layout: Layout) -> list[str]:
    units = scene.units
    lines = [
        f"variable granules equal {scene.chain.granules}",
        "# F0 [N], the natural unit of time and the longest step [s]",
        f"variable peak_force equal {units.force!r}",
        f"variable unit_time equal {units.time!r}",
        "variable longest equal v_step*v_unit_time",
    ]
    changed = [standalone_run.aligned(line) for line in standalone_run.parameters(layout)]
    return ["# ---- Parameters", *changed, *lines]


@dataclass(frozen=True, eq=False)
class _Test:
    """A place for each granule, and the net force on it there: [m], [N], shape (granules,) each."""

    position: FloatArray
    net_force: FloatArray


def _test_force(scene: Scene) -> float:
    """The larger of the forces under which the law is checked [N]: no overlap is above R/10."""
    each = scene.granules
    deepest = float(np.min(each.stiffness)) * (float(np.min(each.radius)) / 10) ** 1.5
    return float(min(scene.units.force, deepest))


def _test(scene: Scene, first_is_pressed_more: bool) -> _Test:
    """All contacts are pressed, every other one more, with the wall where it stands."""
    each, contacts = scene.granules, scene.granules.stiffness.size
    more = np.arange(contacts) % 2 == (0 if first_is_pressed_more else 1)
    force = _test_force(scene) * np.where(more, 1.0, 1 / _PRESSED_MORE)
    overlap = (force / each.stiffness) ** (2 / 3)
    between = scene.chain.granules - 1
    apart = each.radius[:-1] + each.radius[1:] - overlap[:between]
    position = np.concatenate([[0.0], np.cumsum(apart)])
    net = each.constant_force.copy()
    net[:-1] -= force[:between]
    net[1:] += force[:between]
    if scene.wall is not None:
        position += wall_position(scene) - each.radius[-1] + overlap[-1] - position[-1]
        net[-1] -= force[-1]
    return _Test(position, net)


_LAW_FAILED = (
    "Forces, masses or places are not those of this scene:",
    "off by $(v_pressed:%.1e), $(v_pressed_less:%.1e), $(v_heavier:%.1e), $(v_misplaced:%.1e)",
)


def _law(scene: Scene) -> list[str]:
    """The commands that hold forces, masses and places in this LAMMPS against known ones."""
    force, tests = _test_force(scene), [_test(scene, first) for first in (True, False)]
    length = float(np.max(np.abs([test.position for test in tests])))
    shallowest = (force / _PRESSED_MORE / float(np.max(scene.granules.stiffness))) ** (2 / 3)
    differences = {
        "place": f"abs(x-f_known[4])/{shallowest!r}",
        "mass": "abs(mass/f_known[3]-1)",
        "force": f"abs(fx-f_known[6])/{force!r}",
        "other": f"abs(fx-f_known[8])/{force!r}",
    }
    return [
        *_known_numbers(scene, tests),
        "",
        *comment(
            "Does LAMMPS have these places, masses and forces? Unlike contacts, the wall and all"
            f" loads show in the net forces, here over {force:.4g} N, the largest of a contact."
        ),
        *(f"variable off_{name} atom {formula}" for name, formula in differences.items()),
        *(f"compute off_{name} all reduce max v_off_{name}" for name in differences),
        f"thermo_style custom step {' '.join(f'c_off_{name}' for name in differences)}",
        NO_STEP,
        "variable misplaced equal $(c_off_place:%.17g)",
        "variable heavier equal $(c_off_mass:%.17g)",
        *_moved_to("f_known[5]"),
        NO_STEP,
        "variable pressed equal $(c_off_force:%.17g)",
        *_moved_to("f_known[7]"),
        NO_STEP,
        "variable pressed_less equal $(c_off_other:%.17g)",
        *_moved_to("f_known[4]"),
        "thermo_style one",
        "# Positions have so many digits, overlaps as much fewer as they are smaller.",
        f"variable digits equal {1e-11 + 1e-14 * length / shallowest:.3g}",
        'variable law equal "(v_pressed<v_digits)*(v_pressed_less<v_digits)* &',
        '    (v_heavier<1e-11)*(v_misplaced<v_digits)"',
    ]


def _moved_to(place: str) -> list[str]:
    return [f"variable place atom {place}", "set group all x v_place"]


def _known_numbers(scene: Scene, tests: Sequence[_Test]) -> list[str]:
    """The commands that give each granule the numbers ``f_known[1]`` to ``f_known[8]``."""
    each, granules = scene.granules, scene.chain.granules
    reach = np.append(each.radius[:-1] + each.radius[1:], 0.0)
    what = "its radius and the next one's [m]"
    if scene.wall is not None:
        reach[-1] = each.radius[-1] - wall_position(scene)
        what += " (the last: its radius less the wall's place)"
    columns = {
        "reach": reach,
        "stiffness": np.append(each.stiffness, 0.0)[:granules],
        "mass": each.mass,
        "start": each.position,
        "place1": tests[0].position,
        "net1": tests[0].net_force,
        "place2": tests[1].position,
        "net2": tests[1].net_force,
    }
    names = " ".join(f"d_{name}" for name in columns)
    lines = [
        "# ---- What is known of each granule and of its contact with the next",
        *comment(
            f"reach: {what}; stiffness A in F = A overlap^(3/2) [N/m^1.5]; mass [kg]; place at the"
            " start [m]; two places where all contacts are pressed, every other one more [m], and"
            " the net forces there [N]. None of these is from this LAMMPS, which makes its own."
        ),
        f"fix numbers all property/atom {names}",
    ]
    for number, row in enumerate(zip(*columns.values(), strict=True), start=1):
        values = (f"d_{name} {float(value)!r}" for name, value in zip(columns, row, strict=True))
        lines.append(f"set atom {number} {' '.join(values)}")
    return [*lines, f"fix known all store/state 0 {names}", NO_STEP]


def _overlap(scene: Scene) -> str:
    """LAMMPS formula of the overlap of a granule with the next, or with the wall [m].

    Of the last granule there is no next, whose place is 0 then.
    """
    overlap = "f_known[1]+x-c_ahead"
    return overlap if scene.wall is not None else f"(id<${{granules}})*({overlap})"


def _piece(leg: Leg) -> Piece:
    force, what = None, "no applied force"
    if leg.ramp is not None:
        ramp = leg.ramp
        force = force_formula(ramp)
        what = f"from {ramp.start_force:g} N to {ramp.end_force:g} N ({ramp.shape})"
    return Piece(what, repr(leg.start), repr(leg.end), force)


def _verdict(scene: Scene, layout: Layout, known: KnownAnswer, steps: int) -> list[str]:
    granules, lost = scene.chain.granules, predicted_loss(scene, steps)
    contacts = f"contacts 2 to {granules}"
    shown: list[str] = []
    also: dict[str, str] = {}
    if scene.wall is not None:
        contacts += f", and of the wall's, {granules + 1}"
        shown = [
            "compute force all property/atom d_force",
            "compute on_wall last reduce max c_force",
            "",
        ]
        also = {"on_wall": 'print "Peak force on the wall: $(c_on_wall:%.10g) N"'}
    return [
        *standalone_run.peak_commands("f_known[2]*(f_largest*(f_largest>0))^1.5"),
        "",
        *standalone_run.answers(
            known,
            f"True peak forces over F0, of {contacts}, by a method of eleven stages that needs none"
            " of these steps; and what its error, step and interval cost them, measured.",
        ),
        "",
        "# What coordinates cost the peaks",
        f"variable lost equal {lost:.4g}*sqrt({layout.step!r}/v_step)",
        "",
        "# What was measured holds for steps and looks that are no rarer.",
        *standalone_run.conditions([standalone_run.UNCLEAR_DIGITS, *standalone_run.looser(layout)]),
        "",
        *shown,
        *standalone_run.judging_commands(known, _LAW_FAILED, also),
    ]
