"""The part of a deck that runs the scene and judges its peaks."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

import numpy as np

from hertzchain.decks.layout import ROOM, ROUNDING, UNCLEAR, KnownAnswer, Layout
from hertzchain.engines.external.rescaling import NONE, Softening, loss_of_coordinates
from hertzchain.engines.lammps.dialect import LET_GO, NO_STEP, PUSH
from hertzchain.observables.peaks import SIGNIFICANT
from hertzchain.scene.pulse import PROFILES, SHAPES, Pulse, PulseTable
from hertzchain.scene.scene import Scene


@dataclass(frozen=True)
class _Piece:
    """A stretch between two corners of the pulse as the deck says it: formulas and comments."""

    what: str
    begin: str
    finish: str
    force: str | None = None


def comment(text: str) -> list[str]:
    """Text as lines of comment."""
    return textwrap.wrap(text, 98, initial_indent="# ", subsequent_indent="# ")


def watch_commands() -> list[str]:
    """The commands that watch the peaks."""
    return [
        "# ---- Watching: the largest overlap of each contact, kept by the granule behind it",
        "# Each granule is a chunk of its own, so that the sum over it is its position; of these",
        "# each granule gets the one of the next.",
        "variable id atom id",
        "variable next atom id+1",
        "compute position all property/atom x",
        "compute each all chunk/atom v_id nchunk once ids once",
        "compute positions all reduce/chunk each sum c_position",
        "compute ahead all global/atom v_next c_positions",
        "variable overlap atom (id<${granules})*(2*$(v_radius:%.17g)+x-c_ahead)",
        "variable larger atom f_largest*(f_largest>v_overlap)+v_overlap*(f_largest<=v_overlap)",
        "# fix store/state keeps what it stored last, f_largest, but does not make LAMMPS compute",
        "# positions anew at each look; the fix before it, an average of nothing, does.",
        "variable nothing equal 0",
        'if "${watch} > 0" then &',
        '    "fix look all ave/time ${watch} 1 ${watch} v_nothing" &',
        '    "fix largest all store/state ${watch} v_larger"',
    ]


def trajectory_commands(layout: Layout) -> list[str]:
    """The commands that write a trajectory, where one is wanted."""
    if not layout.dump_every:
        return []
    return [
        "# ---- For OVITO",
        "dump states all custom ${dump_every} ${trajectory} id type x y z radius vx fx",
        "dump_modify states sort id",
    ]


def _pieces(scene: Scene, made: Softening) -> list[_Piece]:
    """The legs of ``scene.schedule``, as formulas."""
    shock, pieces = scene.shock, []
    if isinstance(shock, Pulse):
        elapsed = "(time-$(v_begin:%.17g))/$(v_finish-v_begin:%.17g)"
        rise, decay = (SHAPES[shape].formula.format(elapsed) for shape in PROFILES[shock.profile])
        force = "$(v_peak_force:%.17g)"
        pieces = [
            _Piece(f"rise ({PROFILES[shock.profile][0]})", "0", "v_t0", f"{force}*{rise}"),
            _Piece(
                f"decay ({PROFILES[shock.profile][1]})",
                "v_t0",
                "v_pulse_end",
                f"{force}*(1-{decay})",
            ),
        ]
    else:
        assert isinstance(shock, PulseTable)
        stretch = "" if made == NONE else "v_stretch*"
        if shock.time[0] > 0:
            pieces.append(_Piece("no force", "0", f"{stretch}{shock.time[0]!r}"))
        for ramp in scene.ramps:
            change = f"({ramp.end_force!r}-{ramp.start_force!r})"
            pieces.append(
                _Piece(
                    f"from {ramp.start_force:g} N to {ramp.end_force:g} N",
                    f"{stretch}{ramp.start!r}",
                    f"{stretch}{ramp.end!r}",
                    f"{ramp.start_force!r}+{change}"
                    "*(time-$(v_begin:%.17g))/$(v_finish-v_begin:%.17g)",
                )
            )
    pieces.append(_Piece("no force any more", "v_pulse_end", "v_end"))
    return pieces[: len(scene.schedule(scene.end_time))]


def run_commands(scene: Scene, made: Softening) -> list[str]:
    """The commands that run the scene, leg by leg."""
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
    pushed = False
    for piece in pieces:
        lines += [
            "",
            f"# {piece.what[0].upper()}{piece.what[1:]}",
            f"variable begin equal {piece.begin}",
            f"variable finish equal {piece.finish if piece is not last else 'v_end'}",
            "variable steps equal ceil((v_finish-v_begin)/v_longest)",
            "timestep $((v_finish-v_begin)/v_steps:%.17g)",
        ]
        if piece.force is not None:
            force = piece.force
            if piece is last:
                # The ramp goes on beyond the end of the run.
                force = force.replace("$(v_finish-v_begin", f"$({piece.finish}-v_begin")
            lines.append(f"variable force equal {force}")
            if not pushed:
                lines.append(PUSH)
        elif pushed:
            lines.append(LET_GO)
        pushed = piece.force is not None
        lines.append("run ${steps} post no")
    return lines


def verdict_commands(
    scene: Scene, layout: Layout, made: Softening, known: KnownAnswer, steps: int
) -> list[str]:
    """The commands that compare the peaks with the known ones and judge."""
    each, flight = loss_of_coordinates(scene, steps)
    ratio = known.force_ratio
    judged = known.judged
    answers = [
        f"set atom {i + 1} d_true {ratio[i]:.12g} d_cost {known.error[i]:.3g}"
        for i in np.flatnonzero(judged)
    ]
    remark = (
        f"True peak forces over F0, of contacts 2 to {scene.chain.granules}: Eq. 1 by a method of"
        " eleven stages, right to 1e-10; and what step and interval cost them, measured."
    )
    if not np.all(judged):
        remark += (
            f" Those below {SIGNIFICANT:g} of the largest, and those that the interval misses as"
            " the run ends, are left out and not judged."
        )
    cost = (
        f"{ROOM} is room for shorter steps and intervals. Coordinates cost the more digits the"
        " larger granules are beside their overlaps."
    )
    return [
        "# ---- The answer: the largest overlaps, and the forces that Hertz's law gives them",
        """if "${watch} <= 0" then "print 'NOT CHECKED: watch is 0'" quit""",
        "fix answers all property/atom d_force d_true d_cost",
        "variable peak atom $(v_stiffness:%.17g)*f_largest^1.5",
        "set group all d_force v_peak",
        "variable contact atom id+1",
        "group behind id < ${granules}",
        'print "contact,peak_force_N" file ${peaks}',
        "write_dump behind custom ${peaks} v_contact d_force modify append yes header no sort id &",
        '    format line "%.0f, %.17g"',
        "unfix largest",
        "",
        *comment(remark),
        *answers,
        "",
        *comment(cost),
        f"variable coordinate equal 2*v_granules*v_radius/v_unit_length+{flight:.4g}",
        f"variable lost equal {each:.4g}*sqrt({layout.step!r}/v_step)*v_coordinate",
        "",
        "# F/F0 stays the same as long as these do (similarity).",
        "variable same equal 1",
        *_conditions(scene, layout, made),
        "",
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
        "thermo_style custom step c_worst c_where c_expected c_there c_limit c_good",
        NO_STEP,
        "",
        'print ""',
        'if "$(v_law) == 0" then &',
        """    "print 'Forces or masses are not those of these parameters:'" &""",
        """    "print 'off by $(v_pressed:%.1e), $(v_pressed_less:%.1e), $(v_heavier:%.1e)'" &""",
        '    "print FAIL" "quit 1" &',
        'elif "$(v_same) == 0" &',
        """    "print 'NOT CHECKED: ${why}'" quit""",
        'print "Peak forces over F0, contact $(v_where:%.0f), the nearest to its tolerance:"',
        'print "  expected    $(c_expected:%.10f)"',
        'print "  found       $(c_there:%.10f)"',
        'print "  difference  $(abs(c_there/c_expected-1):%.1e)"',
        'print "  tolerance   $(c_limit:%.1e)"',
        f'if "$(c_good) == {int(np.sum(judged))}" then "print PASS" else "print FAIL" "quit 1"',
    ]


def _conditions(scene: Scene, layout: Layout, made: Softening) -> list[str]:
    """Commands that set ``same`` to 0, and ``why``, where F/F0 may be another one."""
    shock, chain, unit = scene.shock, scene.chain, scene.units.time
    end = scene.end_time / unit
    unclear = f"{ROUNDING}*v_lost>{UNCLEAR}"
    # The highest peaks expected, 5 F0, press three times as deep: below R, from where on second
    # neighbours touch. A softened chain is made as deep as it may be.
    deepest = max(0.3, 1.01 * scene.units.length * made.length / chain.radius)
    changed: list[tuple[str, str, float]] = [
        (unclear, "coordinates may cost more than {} of a peak", UNCLEAR),
        (f"v_unit_length>{deepest!r}*v_radius", "F0 presses granules by more than {} R", deepest),
        (f"v_watch>{layout.watch_every}", "watch is above {}", layout.watch_every),
        (f"v_step>{layout.step!r}", "step is above {}", layout.step),
        (
            f"abs(v_end/v_unit_time/{end!r}-1)>1e-9",
            "the end is not at {} natural units any more",
            end,
        ),
    ]
    if isinstance(shock, Pulse):
        n, ratio = shock.duration_ratio, scene.momentum_ratio
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
    return [
        f"""if "$({formula}) == 1" then &
    "variable same equal 0" "variable why string '{text.format(f"{value:.10g}")}'\""""
        for formula, text, value in changed
    ]
