"""A scene as one LAMMPS deck that runs, and judges itself, without Python: pure text.

It is the deck of the LAMMPS engine with additions: known numbers, samples of the contact forces,
and a verdict. Where coordinates would lose digits, the deck has a softer, similar chain.
"""

from __future__ import annotations

from importlib.metadata import version

import numpy as np

from hertzchain.decks.known_numbers import KnownNumbers, comment
from hertzchain.decks.layout import KnownAnswer, Layout, plain, similar, what_is_softer
from hertzchain.engines.external.rescaling import NONE, Softening
from hertzchain.engines.lammps.damping import oldest
from hertzchain.engines.lammps.deck import START, chain, leg_commands, refuse_pair_style
from hertzchain.engines.lammps.dialect import NO_STEP, OLDEST, write_dump
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.scene.schedule import Leg


def standalone(scene: Scene, layout: Layout, known: KnownAnswer | None = None) -> str:
    """Return a deck for ``lmp -in FILE``, on any processors; ``known`` is None for lean decks.

    RunFailed for a layout that is impossible with terms.
    """
    if (known is None) != (layout.watch_every == 0):
        raise SceneError("watch_every", layout.watch_every, "must be 0 where no peaks are known")
    refuse_pair_style(scene, layout.pair_style)
    legs, made = similar(scene, layout.step)
    softer = made.scene(scene)
    sections = [
        _header(scene, layout, known, sum(leg.steps for leg in legs), made),
        _parameters(layout),
        [
            "# ---- The granules, shared out among processors along the chain",
            *START,
            "processors * 1 1",
            "",
            *chain(softer, layout.pair_style),
            "thermo 0",
            "# A step is so short that taking the time of its parts would cost a fifth of it.",
            "timer off",
        ],
    ]
    if known is None:
        sections += [
            _trajectory(layout),
            _run(scene, legs),
            [write_dump("chain.final", ("x", "vx", "fx"))],
        ]
    else:
        numbers = KnownNumbers(softer, known)
        sections += [
            numbers.commands(),
            _watch(softer, numbers),
            _trajectory(layout),
            _run(scene, legs),
            _peaks(softer),
            _verdict(softer, layout, known, numbers),
        ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def _header(
    scene: Scene, layout: Layout, known: KnownAnswer | None, steps: int, made: Softening
) -> list[str]:
    run = f"lmp -in {plain(layout.name)}"
    count, terms = scene.chain.granules, list(scene.terms)
    elastic = " elastic" if scene.contact is None else ""
    which = f"with {' and '.join(terms)}" if terms else "pushed at one end"
    needed = oldest(scene)
    since = OLDEST if needed is None else needed[1]
    changed = ["watch", "peaks"] if known is not None else []
    changed += ["dump_every", "trajectory"] if layout.dump_every else []
    fixed = "Have another deck written for another scene."
    if changed:
        fixed = f"Only {', '.join(changed)} can be changed by -var. {fixed}"
    if known is None:
        fixed += " Nothing checks here what -var of another name changes."
    paragraphs = [_expected(scene, known), fixed]
    if made != NONE:
        paragraphs.insert(0, what_is_softer(made))
    return [
        *comment(
            f"{plain(layout.title)}: a chain of {count}{elastic} spheres in Hertz contact, {which}."
            f" Written by hertzchain {version('hertzchain')} for LAMMPS of {since} and later. SI"
            " units throughout."
        ),
        "#",
        f"#   {run}                 {steps} steps",
        f"#   mpiexec -n 2 {run}    on two processors, the same result",
        *([] if known is None else [f"#   {run} -var watch 1    a look at every step"]),
        "#",
        *comment(" ".join(paragraphs)),
    ]


def _expected(scene: Scene, known: KnownAnswer | None) -> str:
    """Return the results of the deck, in words."""
    if known is None:
        return (
            "Peak forces are not watched. The final state goes to chain.final: id, x [m], vx [m/s],"
            " fx [N]."
        )
    wall = "" if scene.wall is None else f" Contact {scene.last_contact}, on the screen,"
    wall += " is the wall's." if wall else ""
    if scene.near_wall is not None:
        wall += " Contact 1 is the near wall's, for which fixed granule 1 stands here."
    damped = ", damping included" if scene.contact is not None else ""
    first = ", ".join(f"{value:.4f}" for value in known.force_ratio[:3])
    last = f", ..., {known.force_ratio[-1]:.4f}" if known.force_ratio.size > 3 else ""
    return (
        "The peak force of each contact goes to peaks.csv; contact i lies between granules i - 1"
        f" and i.{wall} Peaks are total forces{damped}. Over F0, {_unit(scene)}, they are expected"
        f" to be {first}{last}, right to {known.largest_error:.1e}. The end says PASS, FAIL"
        " (exit status 1) or NOT CHECKED (3)."
    )


def _unit(scene: Scene) -> str:
    """Return the name of the unit of force of a scene, and its value."""
    return f"{_name_of_unit(scene)} ({scene.units.force:.6g} N)"


def _name_of_unit(scene: Scene) -> str:
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


def _parameters(layout: Layout) -> list[str]:
    """Return the variables that ``-var`` overrides."""
    lines = []
    if layout.watch_every:
        lines += [
            f"variable watch index {layout.watch_every} # steps between two looks",
            "variable peaks index peaks.csv # where the peak forces go",
        ]
    if layout.dump_every:
        lines += [
            f"variable dump_every index {layout.dump_every} # steps between two states for OVITO",
            "variable trajectory index chain.lammpstrj",
        ]
    return ["# ---- Parameters", *lines] if lines else []


def _trajectory(layout: Layout) -> list[str]:
    if not layout.dump_every:
        return []
    return [
        "# ---- For OVITO",
        "dump states all custom ${dump_every} ${trajectory} id type x y z radius vx fx",
        "dump_modify states sort id",
    ]


def _watch(scene: Scene, numbers: KnownNumbers) -> list[str]:
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
        if leg.ramp is not None:
            ramp = leg.ramp
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


def _verdict(scene: Scene, layout: Layout, known: KnownAnswer, numbers: KnownNumbers) -> list[str]:
    """Return the commands that compare the peaks with the true ones, and print the verdict."""
    true, allowed = numbers.name("true"), numbers.name("allowed")
    wall, on_wall = [], []
    if scene.wall is not None:
        wall = ["compute on_wall last reduce max c_peak"]
        on_wall = ['print "Peak force on the wall: $(c_on_wall:%.10g) N"']
    here, right = "(v_contact==v_where)", int(np.sum(known.judged))
    return [
        f"variable found atom c_peak/{scene.units.force!r}",
        f"variable off atom ({true}>0)*abs(v_found/({true}+({true}==0))-1)",
        f"variable share atom v_off/{allowed}",
        "compute worst all reduce max v_share",
        "variable worst equal c_worst",
        f"variable at atom v_contact*({true}>0)*(v_share>=v_worst*(1-1e-12))",
        "compute where all reduce max v_at",
        "variable where equal c_where",
        f"variable expected atom {true}*{here}",
        f"variable there atom v_found*{here}",
        f"variable limit atom {allowed}*{here}",
        "compute shown all reduce max v_expected v_there v_limit",
        f"variable good atom ({true}>0)*(v_off<={allowed})",
        "compute good all reduce sum v_good",
        *wall,
        " ".join(
            [
                "thermo_style custom step c_worst c_where c_shown[1] c_shown[2] c_shown[3] c_good",
                *(["c_on_wall"] if wall else []),
            ]
        ),
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
