"""A scene with terms as one LAMMPS deck that runs, and judges itself, without Python: pure text.

The deck has every granule with its own size, material and place. Only steps and samples can be
changed with ``-var``: no similarity keeps the peaks of such a scene.
"""

from __future__ import annotations

from importlib.metadata import version

import numpy as np

from hertzchain.decks import standalone_run, terms_law
from hertzchain.decks.layout import KnownAnswer, Layout
from hertzchain.decks.standalone_run import Piece, comment
from hertzchain.decks.terms_law import KnownNumbers
from hertzchain.engines.external.rescaling import predicted_loss
from hertzchain.engines.external.terms import PISTON_MOTION
from hertzchain.engines.lammps.damped_deck import oldest
from hertzchain.engines.lammps.deck import (
    MOTION,
    START,
    force_formula,
    granules,
    held,
    refuse_pair_style,
)
from hertzchain.engines.lammps.dialect import OLDEST, write_dump
from hertzchain.errors import RunFailed
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


def deck(scene: Scene, layout: Layout, known: KnownAnswer | None) -> str:
    """Return the text of a deck for ``lmp -in FILE``; ``known`` is None for a lean deck.

    RunFailed for a layout that is impossible with terms.
    """
    check(scene, layout)
    legs = scene.schedule(layout.step * scene.units.time)
    steps = sum(leg.steps for leg in legs)
    numbers = KnownNumbers(scene)
    watching = standalone_run.watch_commands(numbers.overlap, numbers.force)
    sections = [
        _header(scene, layout, known, steps),
        _parameters(scene, layout),
        [
            "# ---- The granules, shared out among processors along the chain",
            *START,
            "processors * 1 1",
            "",
            *granules(scene, layout.pair_style, None),
            "",
            *(MOTION if scene.piston is None else PISTON_MOTION),
            "thermo 0",
            "# A step is so short that taking the time of its parts would cost a fifth of it.",
            "timer off",
            "",
            "# ---- What holds and pushes them all the time",
            *held(scene, None),
        ],
        *([] if known is None else [numbers.commands(), watching]),
        standalone_run.trajectory_commands(layout),
        [
            "# ---- The run",
            *standalone_run.leg_commands([_piece(leg) for leg in legs]),
        ],
        [write_dump("chain.final", ("x", "vx", "fx"))]
        if known is None
        else _verdict(scene, layout, known, numbers, steps),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def check(scene: Scene, layout: Layout) -> None:
    """Raise RunFailed for a layout that is impossible with terms."""
    refuse_pair_style(scene, layout.pair_style)
    if layout.atoms != "create":
        raise RunFailed(
            f"a data file holds equal granules that touch, not {' and '.join(scene.terms)}: leave"
            " out --atoms data, the deck names every granule"
        )


def _header(scene: Scene, layout: Layout, known: KnownAnswer | None, steps: int) -> list[str]:
    run = f"lmp -in {layout.name}"
    count, *terms = scene.chain.granules, *scene.terms
    elastic = " elastic" if scene.contact is None else ""
    listed = ", ".join(terms[:-1]) + " and " + terms[-1] if len(terms) > 1 else terms[0]
    needed = oldest(scene)
    since = OLDEST if needed is None else needed[1]
    what = (
        f"{layout.title}: a chain of {count}{elastic} spheres in Hertz contact, with {listed}."
        f" Written by hertzchain {version('hertzchain')} for LAMMPS of {since} and later. SI units"
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
    of_wall = "" if scene.wall is None else f" Contact {count + 1}, on the screen, is the wall's."
    included, damped = "static loads", ""
    if scene.contact is not None:
        included = "damping and static loads"
        damped = " Energy is not judged: looks now and then do not tell what dampers took."
    first = ", ".join(f"{value:.4f}" for value in known.force_ratio[:3])
    last = f", ..., {known.force_ratio[-1]:.4f}" if known.force_ratio.size > 3 else ""
    expected = (
        "The peak force of each contact goes to peaks.csv; contact i lies between granules i - 1"
        f" and i.{of_wall} Peaks are total forces, {included} included. Over F0, {_unit(scene)},"
        f" they are expected to be {first}{last}, right to {known.largest_error:.1e}. The last line"
        " says PASS or FAIL (exit status 1); NOT CHECKED after longer steps or rarer looks."
        f"{damped} {fixed}"
    )
    return [*lines, *comment(expected)]


def _unit(scene: Scene) -> str:
    """Return the name of the unit of force of a scene."""
    if scene.piston is not None:
        return _unit_of_piston(scene)
    if scene.units.force > scene.peak_force:
        return "the largest static force"
    if scene.striker is not None:
        return "the peak force of the striker's contact alone"
    return "the largest applied force"


def _unit_of_piston(scene: Scene) -> str:
    static = 0.0
    if scene.precompression is not None:
        static = float(np.max(scene.granules.static_force))
    if scene.units.force > max(scene.peak_force, static):
        return "the force of a chain that the piston presses against the wall as far as it goes"
    if scene.units.force > scene.peak_force:
        return "the largest static force"
    return "the peak force of granule 2 alone, hit with the largest velocity of the piston"


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


def _piece(leg: Leg) -> Piece:
    force, what = None, "no applied force"
    if leg.ramp is not None:
        ramp = leg.ramp
        force = force_formula(ramp)
        what = f"from {ramp.start_force:g} N to {ramp.end_force:g} N ({ramp.shape})"
    if leg.stroke is not None:
        what = f"the piston moves at {leg.stroke.velocity:g} m/s"
    return Piece(what, repr(leg.start), repr(leg.end), force, leg.stroke)


def _verdict(
    scene: Scene, layout: Layout, known: KnownAnswer, numbers: KnownNumbers, steps: int
) -> list[str]:
    count, lost = scene.chain.granules, predicted_loss(scene, steps)
    contacts = f"contacts 2 to {count}"
    shown: list[str] = []
    also: dict[str, str] = {}
    if scene.wall is not None:
        contacts += f", and of the wall's, {count + 1}"
        shown = [
            "compute force all property/atom d_force",
            "compute on_wall last reduce max c_force",
            "",
        ]
        also = {"on_wall": 'print "Peak force on the wall: $(c_on_wall:%.10g) N"'}
    peak = f"{numbers.name('stiffness')}*(f_largest*(f_largest>0))^1.5"
    method = "eleven stages that needs none of these steps"
    if scene.contact is not None:
        peak, method = "f_largest", "order eight with steps of its own"
    return [
        *standalone_run.peak_commands(peak),
        "",
        *standalone_run.answers(
            known,
            f"True peak forces over F0, of {contacts}, by a method of {method}; and what its error,"
            " step and interval cost them, measured.",
        ),
        "",
        "# What coordinates cost the peaks",
        f"variable lost equal {lost:.4g}*sqrt({layout.step!r}/v_step)",
        "",
        "# What was measured holds for steps and looks that are no rarer.",
        *standalone_run.conditions([standalone_run.UNCLEAR_DIGITS, *standalone_run.looser(layout)]),
        "",
        *shown,
        *standalone_run.judging_commands(known, terms_law.failed(scene), also),
    ]
