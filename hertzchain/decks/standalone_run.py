"""The part of a deck that runs the scene and judges its peaks."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hertzchain.decks.layout import ROOM, ROUNDING, UNCLEAR, KnownAnswer, Layout
from hertzchain.engines.external.rescaling import NONE, Softening, loss_of_coordinates
from hertzchain.engines.external.terms import LET_GO_PISTON, stroke_commands
from hertzchain.engines.lammps.dialect import LET_GO, NO_STEP, PUSH
from hertzchain.observables.peaks import SIGNIFICANT
from hertzchain.scene.ramp import SHAPES
from hertzchain.scene.scene import Scene
from hertzchain.scene.shock import Stroke


@dataclass(frozen=True)
class Piece:
    """A leg between two corners of the pulse, as formulas and comments of the deck."""

    what: str
    begin: str
    finish: str
    force: str | None = None
    stroke: Stroke | None = None


def comment(text: str) -> list[str]:
    """Return text as lines of comment."""
    return textwrap.wrap(text, 98, initial_indent="# ", subsequent_indent="# ")


def by_granule(name: str, values: Mapping[int, str]) -> list[str]:
    """Return a variable with a value in each granule, counted from 0, and 0 in all others.

    A ``set`` for each would print three lines for each, which bury the verdict.
    """
    runs: list[tuple[int, int, str]] = []  # of neighbours with the same value
    for i, value in values.items():
        if not runs or runs[-1][1:] != (i, value):
            runs.append((i + 1, i + 1, value))
        runs[-1] = (runs[-1][0], i + 1, value)
    terms = (
        f"+(id=={first})*{value}" if first == last else f"+(id>={first})*(id<={last})*{value}"
        for first, last, value in runs
    )
    lines = textwrap.wrap(" ".join(terms), 92, break_on_hyphens=False)
    lines = textwrap.indent("\n".join(lines), "    ").splitlines()
    return [f'variable {name} atom "0 &', *(f"{line} &" for line in lines[:-1]), f'{lines[-1]}"']


def aligned(line: str) -> str:
    """Return a command with its comment in a fixed column."""
    command, mark, comment = line.partition("#")
    return f"{command.rstrip():<44}# {comment.strip()}" if command and mark else line


def parameters(layout: Layout) -> list[str]:
    """Return the variables of steps, samples and states for OVITO, which ``-var`` overrides."""
    lines = [f"variable step index {layout.step!r} # the longest step, natural time units"]
    if layout.watch_every:
        lines += [
            f"variable watch index {layout.watch_every} # steps between two looks; 0: never",
            "variable peaks index peaks.csv # where the peak forces go",
        ]
    if layout.dump_every:
        lines += [
            f"variable dump_every index {layout.dump_every} # steps between two states for OVITO",
            "variable trajectory index chain.lammpstrj",
        ]
    return lines


def watch_commands(overlap: str, force: str | None = None) -> list[str]:
    """Commands that watch the peaks, from the formula of a granule's overlap with the next.

    Damped contacts also need a formula of the force from ``touching`` (the overlap or 0) and
    ``rate``, because the largest overlap does not give their largest force.
    """
    watched, kept = "overlap", "overlap"
    damped: list[str] = []
    if force is not None:
        watched, kept = "force", "total"
        damped = [
            "# Velocities in the same way: damping makes the force depend on the overlap's rate.",
            "compute speed all property/atom vx",
            "compute speeds all reduce/chunk each sum c_speed",
            "compute speed_ahead all global/atom v_next c_speeds",
            "variable rate atom vx-c_speed_ahead",
            "variable touching atom v_overlap*(v_overlap>0)",
            f"variable total atom {force}",
        ]
    return [
        f"# ---- Watching: the largest {watched} of each contact, kept by the granule behind it",
        "# Each granule is a chunk of its own, so that the sum over it is its position; of these",
        "# each granule gets the one of the next.",
        "variable id atom id",
        "variable next atom id+1",
        "compute position all property/atom x",
        "compute each all chunk/atom v_id nchunk once ids once",
        "compute positions all reduce/chunk each sum c_position",
        "compute ahead all global/atom v_next c_positions",
        f"variable overlap atom {overlap}",
        *damped,
        f"variable larger atom f_largest*(f_largest>v_{kept})+v_{kept}*(f_largest<=v_{kept})",
        "# fix store/state keeps what it stored last, f_largest, but does not make LAMMPS compute",
        "# positions again at each look; the fix before it, an average of nothing, does.",
        "variable nothing equal 0",
        'if "${watch} > 0" then &',
        '    "fix look all ave/time ${watch} 1 ${watch} v_nothing" &',
        '    "fix largest all store/state ${watch} v_larger"',
    ]


def trajectory_commands(layout: Layout) -> list[str]:
    """Return the commands that write a trajectory, if one is wanted."""
    if not layout.dump_every:
        return []
    return [
        "# ---- For OVITO",
        "dump states all custom ${dump_every} ${trajectory} id type x y z radius vx fx",
        "dump_modify states sort id",
    ]


def _pieces(scene: Scene, made: Softening) -> list[Piece]:
    """Return the legs of ``scene.schedule`` as formulas."""
    pieces, ramps = [], scene.ramps
    elapsed = "(time-$(v_begin:%.17g))/$(v_finish-v_begin:%.17g)"
    grown = [SHAPES[ramp.shape].for_lammps(elapsed) for ramp in ramps]
    if scene.pulse is not None:
        (rise, decay), force = ramps, "$(v_peak_force:%.17g)"
        fall = f"{force}*(1-{grown[1]})"
        pieces = [
            Piece(f"rise ({rise.shape})", "0", "v_t0", f"{force}*{grown[0]}"),
            Piece(f"decay ({decay.shape})", "v_t0", "v_pulse_end", fall),
        ]
    else:
        stretch = "" if made == NONE else "v_stretch*"
        if ramps[0].start > 0:
            pieces.append(Piece("no force", "0", f"{stretch}{ramps[0].start!r}"))
        for ramp, growth in zip(ramps, grown, strict=True):
            change = f"({ramp.end_force!r}-{ramp.start_force!r})"
            pieces.append(
                Piece(
                    f"from {ramp.start_force:g} N to {ramp.end_force:g} N",
                    f"{stretch}{ramp.start!r}",
                    f"{stretch}{ramp.end!r}",
                    f"{ramp.start_force!r}+{change}*{growth}",
                )
            )
    pieces.append(Piece("no force any more", "v_pulse_end", "v_end"))
    return pieces[: len(scene.schedule(scene.end_time))]


def run_commands(scene: Scene, made: Softening) -> list[str]:
    """Return the commands that run the scene, leg by leg."""
    pieces = _pieces(scene, made)
    last = pieces[-1]
    limits = [f'"$({last.begin}) >= $(v_end)"']
    if last.finish != "v_end":
        limits.append(f'"$(v_end) > $({last.finish})"')
    lines = ["# ---- The run: steps end at the corners of the pulse, and are equal between them"]
    for limit in limits:
        lines += [
            f"if {limit} then &",
            """    "print 'The run has to end on the same part of the pulse: change end_time'" &""",
            '    "quit 2"',
        ]
    if last.force is not None:
        # The ramp continues beyond the end of the run.
        force = last.force.replace("$(v_finish-v_begin", f"$({last.finish}-v_begin")
        last = replace(last, force=force)
    return lines + leg_commands([*pieces[:-1], replace(last, finish="v_end")])


def leg_commands(pieces: Sequence[Piece]) -> list[str]:
    """Return the commands that run piece after piece, each in equal steps."""
    lines: list[str] = []
    pushed = moved = False
    for piece in pieces:
        lines += [
            "",
            f"# {piece.what[0].upper()}{piece.what[1:]}",
            f"variable begin equal {piece.begin}",
            f"variable finish equal {piece.finish}",
            *([LET_GO_PISTON] if moved else []),
            "variable steps equal ceil((v_finish-v_begin)/v_longest)",
            "timestep $((v_finish-v_begin)/v_steps:%.17g)",
        ]
        if piece.force is not None:
            lines.append(f"variable force equal {piece.force}")
            if not pushed:
                lines.append(PUSH)
        elif pushed:
            lines.append(LET_GO)
        pushed, moved = piece.force is not None, piece.stroke is not None
        if piece.stroke is not None:
            lines += stroke_commands(piece.stroke)
        lines.append("run ${steps} post no")
    return lines


def verdict_commands(
    scene: Scene, layout: Layout, made: Softening, known: KnownAnswer, steps: int
) -> list[str]:
    """Return the commands that compare the peaks with the known ones and judge."""
    each, flight = loss_of_coordinates(scene, steps)
    cost = (
        f"{ROOM} is room for shorter steps and intervals. Coordinates cost the more digits the"
        " larger granules are compared with their overlaps."
    )
    return [
        *peak_commands("$(v_stiffness:%.17g)*f_largest^1.5"),
        "",
        *answers(
            known,
            f"True peak forces over F0, of contacts 2 to {scene.chain.granules}: Eq. 1 by a method"
            " of eleven stages, right to 1e-10; and what step and interval cost them, measured.",
        ),
        "",
        *comment(cost),
        f"variable coordinate equal 2*v_granules*v_radius/v_unit_length+{flight:.4g}",
        f"variable lost equal {each:.4g}*sqrt({layout.step!r}/v_step)*v_coordinate",
        "",
        "# F/F0 stays the same as long as these do (similarity).",
        *conditions(_changes(scene, layout, made)),
        "",
        *judging_commands(known, LAW_FAILED, {}),
    ]


def answers(known: KnownAnswer, remark: str) -> list[str]:
    """Return the commands that store in each granule the true peak of its contact with the next."""
    ratio, judged = known.force_ratio, known.judged
    if not np.all(judged):
        remark += (
            f" Those below {SIGNIFICANT:g} of the largest, and those that the interval misses as"
            " the run ends, are left out and not judged."
        )
    which = np.flatnonzero(judged)
    return [
        *comment(remark),
        *by_granule("true", {int(i): f"{ratio[i]:.12g}" for i in which}),
        *by_granule("cost", {int(i): f"{known.error[i]:.3g}" for i in which}),
        "set group all d_true v_true d_cost v_cost",
    ]


def peak_commands(force: str) -> list[str]:
    """Return the commands that write the peaks, from the formula of a contact's force."""
    what = "the largest overlaps, and the forces that Hertz's law gives them"
    return [
        f"# ---- The answer: {'the largest forces' if force == 'f_largest' else what}",
        """if "${watch} <= 0" then "print 'NOT CHECKED: watch is 0'" quit""",
        "fix answers all property/atom d_force d_true d_cost",
        f"variable peak atom {force}",
        "set group all d_force v_peak",
        "variable contact atom id+1",
        "group behind id < ${granules}",
        'print "contact,peak_force_N" file ${peaks}',
        "write_dump behind custom ${peaks} v_contact d_force modify append yes header no sort id &",
        '    format line "%.0f, %.17g"',
        "unfix largest",
    ]


LAW_FAILED = (
    "Forces or masses are not those of these parameters:",
    "off by $(v_pressed:%.1e), $(v_pressed_less:%.1e), $(v_heavier:%.1e)",
)
"""Lines that a plain deck prints if its LAMMPS has another law or other masses."""


def judging_commands(
    known: KnownAnswer, law_failed: Sequence[str], also: Mapping[str, str]
) -> list[str]:
    """Return the commands that print PASS, FAIL or NOT CHECKED, after peaks and answers are stored.

    ``law_failed`` has the lines to print if the variable ``law`` is 0; ``also`` has names of
    further computes, each with the command that prints it.
    """
    right = int(np.sum(known.judged))
    return [
        "compute found all property/atom d_force",
        "compute true all property/atom d_true",
        "variable found atom c_found/$(v_peak_force:%.17g)",
        "compute cost all property/atom d_cost",
        "variable off atom (c_true>0)*abs(v_found/(c_true+(c_true==0))-1)",
        f"variable allowed atom {ROOM}*c_cost+{ROUNDING}*$(v_lost:%.17g)",
        "variable share atom v_off/v_allowed",
        "compute worst all reduce max v_share",
        "variable worst equal c_worst",
        "variable at atom v_contact*(c_true>0)*(v_share>=v_worst*(1-1e-12))",
        "compute where all reduce max v_at",
        "variable where equal c_where",
        "variable expected atom c_true*(v_contact==v_where)",
        "variable there atom v_found*(v_contact==v_where)",
        "compute expected all reduce max v_expected",
        "compute there all reduce max v_there",
        "variable limit atom v_allowed*(v_contact==v_where)",
        "compute limit all reduce max v_limit",
        "variable good atom (c_true>0)*(v_off<=v_allowed)",
        "compute good all reduce sum v_good",
        " ".join(
            [
                "thermo_style custom step c_worst c_where c_expected c_there c_limit c_good",
                *(f"c_{name}" for name in also),
            ]
        ),
        NO_STEP,
        "",
        'print ""',
        *also.values(),
        'if "$(v_law) == 0" then &',
        *(f"""    "print '{line}'" &""" for line in law_failed),
        '    "print FAIL" "quit 1" &',
        'elif "$(v_same) == 0" &',
        """    "print 'NOT CHECKED: ${why}'" quit""",
        'print "Peak forces over F0, contact $(v_where:%.0f), the nearest to its tolerance:"',
        'print "  expected    $(c_expected:%.10f)"',
        'print "  found       $(c_there:%.10f)"',
        'print "  difference  $(abs(c_there/c_expected-1):%.1e)"',
        'print "  tolerance   $(c_limit:%.1e)"',
        f'if "$(c_good) == {right}" then "print PASS" else "print FAIL" "quit 1"',
    ]


Change = tuple[str, str, float]
"""A condition: a formula that is 1 if F/F0 may differ, its message, and the number in this."""


def _changes(scene: Scene, layout: Layout, made: Softening) -> list[Change]:
    pulse, chain, unit = scene.pulse, scene.chain, scene.units.time
    end = scene.end_time / unit
    # The highest peaks expected, 5 F0, press three times as deep; from R on second neighbours
    # touch. A softened chain is as soft as this allows.
    deepest = max(0.3, 1.01 * scene.units.length * made.length / chain.radius)
    changed: list[Change] = [
        UNCLEAR_DIGITS,
        (f"v_unit_length>{deepest!r}*v_radius", "F0 presses granules by more than {} R", deepest),
        *looser(layout),
        (
            f"abs(v_end/v_unit_time/{end!r}-1)>1e-9",
            "the end is not at {} natural units any more",
            end,
        ),
    ]
    if pulse is not None:
        n, ratio = pulse.duration_ratio, scene.momentum_ratio
        changed += [
            (f"abs(v_duration_ratio/{n!r}-1)>1e-9", "n is not {} any more", n),
            (f"abs(v_LM/{ratio!r}-1)>1e-9", "LM_ratio is not {} any more", ratio),
        ]
    else:
        given = "v_unit_time" if made == NONE else "(v_unit_time/v_stretch)"
        changed.append(
            (f"abs({given}/{unit!r}-1)>1e-9", "the natural time unit is not {} s any more", unit)
        )
    changed.append((f"v_granules!={chain.granules}", "N is not {} any more", chain.granules))
    return changed


UNCLEAR_DIGITS: Change = (
    f"{ROUNDING}*v_lost>{UNCLEAR}",
    "coordinates may cost more than {} of a peak",
    UNCLEAR,
)


def looser(layout: Layout) -> list[Change]:
    """Return conditions of rarer samples and longer steps, for which no error was measured."""
    return [
        (f"v_watch>{layout.watch_every}", "watch is above {}", layout.watch_every),
        (f"v_step>{layout.step!r}", "step is above {}", layout.step),
    ]


def conditions(changes: Sequence[Change]) -> list[str]:
    """Return the commands that set ``same`` to 0, and ``why``, where F/F0 may differ."""
    return [
        "variable same equal 1",
        *(
            f"""if "$({formula}) == 1" then &
    "variable same equal 0" "variable why string '{text.format(f"{value:.10g}")}'\""""
            for formula, text, value in changes
        ),
    ]
