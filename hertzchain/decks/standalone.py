"""A scene as one LAMMPS deck that runs, and judges itself, without Python: pure text.

The deck is written for strangers: every parameter is a variable that ``-var`` overrides, all that
follows from them is a formula in the deck, and LAMMPS gets the raw E, nu, R and rho. It keeps the
largest overlap of each contact itself, makes peak forces of it, and compares them with the true
ones that it carries, over the largest applied force: by similarity they hold for any other
granules and forces that keep LM_ratio, n and N.

It is one text for every LAMMPS from 29 Sep 2021 on. What only later ones know is not in it:
ternary(), d_name in formulas, fix set, compute reduce of local values.
"""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from numpy.typing import NDArray

from hertzchain.arrays import FloatArray
from hertzchain.engines.external.rescaling import (
    NONE,
    Softening,
    loss_of_coordinates,
    predicted_loss,
    softening,
)
from hertzchain.engines.lammps.deck import (
    GRANULES,
    MOTION,
    PAIR_STYLES,
    SKIN,
    START,
    check_pair_style,
    parameters,
)
from hertzchain.errors import SceneError, require
from hertzchain.observables.peaks import SIGNIFICANT, judged_contacts
from hertzchain.scene.pulse import PROFILES, SHAPES, Pulse, PulseTable
from hertzchain.scene.scene import Scene

ATOMS = ("create", "data")
"""Where the granules come from: made in the deck, or read from a data file beside it."""

WANTED = 1e-6
"""Loss of digits to absolute coordinates, as a fraction of the peaks, up to which a deck computes
the scene as it stands."""

ROOM = 1.1
"""Tolerance over the measured error: a shorter step or interval than the one that was measured puts
its looks elsewhere."""

ROUNDING = 3
"""Room for round-off over its estimate, which is no bound; 0.2 of it measured in the gallery."""

_UNCLEAR = 1e-3
"""Room for round-off from which on a comparison says nothing."""

_BORDER = 1e-9
"""So close to a whole number of steps, LAMMPS and native might round up to different ones."""


@dataclass(frozen=True, eq=False)
class KnownAnswer:
    """What a deck has to find, and how well it can with its step and interval.

    Parameters
    ----------
    force_ratio
        True peak force of each contact over F0, shape (contacts,).
    error
        Of each contact, the relative difference from it of velocity Verlet with the deck's step,
        looked at in the deck's interval, shape (contacts,).
    """

    force_ratio: FloatArray
    error: FloatArray

    @property
    def judged(self) -> NDArray[np.bool_]:
        """Contacts that are pressed enough to be judged, and about as well known as most.

        Where a run ends before the wave is there, a contact may rise so fast that an interval
        misses much of it.
        """
        pressed = judged_contacts(self.force_ratio)
        most = max(_UNCLEAR, 10 * float(np.median(self.error[pressed])))
        return np.logical_and(pressed, self.error <= most)

    @property
    def largest_error(self) -> float:
        """Of the contacts that are judged."""
        return float(np.max(self.error[self.judged]))


@dataclass(frozen=True)
class Layout:
    """How a deck is written; none of it changes the motion.

    Parameters
    ----------
    step
        The largest step, natural time units; from ``whole_step``.
    watch_every
        Steps between two looks at the overlaps; 0: never, which makes the deck lean.
    pair_style
        ``granular`` (with hertz/material) or ``gran/hertz/history``.
    atoms
        ``create`` or ``data``.
    data_file
        How the deck names its data file.
    dump_every
        Steps between two states written for OVITO; 0: none.
    title
        What the deck says it is.
    name
        How the deck names itself in its example commands.

    Raises
    ------
    SceneError
        For a pair style, a source of the granules, or a number of steps that cannot be.
    """

    step: float
    watch_every: int
    pair_style: str = "granular"
    atoms: str = "create"
    data_file: str = "chain.data"
    dump_every: int = 0
    title: str = "a scene"
    name: str = "THIS_FILE"

    def __post_init__(self) -> None:
        check_pair_style(self.pair_style)
        require(self.atoms in ATOMS, "atoms", self.atoms, f"must be one of {', '.join(ATOMS)}")
        for key, value in (("watch_every", self.watch_every), ("dump_every", self.dump_every)):
            require(value >= 0, key, value, "must be a number of steps, 0 for never")


@dataclass(frozen=True)
class _Piece:
    """A stretch between two corners of the pulse as the deck says it: formulas and comments."""

    what: str
    begin: str
    finish: str
    force: str | None = None


def whole_step(scene: Scene, step: float) -> float:
    """A step with which deck and native count the same steps, on every leg.

    Parameters
    ----------
    scene
        What to simulate.
    step
        The step wanted, natural time units; a little less comes back where a leg would be a whole
        number of them but for rounding.

    Raises
    ------
    TooExpensive
        If there would be more steps than any run can take.
    """
    while any(
        round(steps) > 0 and abs(steps - round(steps)) <= max(_BORDER, 1e-14 * steps)
        for steps in (
            (leg.end - leg.start) / (step * scene.units.time)
            for leg in scene.schedule(step * scene.units.time)
        )
    ):
        step = float(f"{step * (1 - 1e-5):.8g}")
    return step


def standalone(scene: Scene, layout: Layout, known: KnownAnswer | None = None) -> str:
    """A deck that runs with ``lmp -in FILE``, alone or on several processors.

    Parameters
    ----------
    scene
        What to simulate.
    layout
        How.
    known
        What it has to find; None where peaks are not watched.

    Raises
    ------
    SceneError
        If peaks are watched and nothing is known of them, or the other way round.
    """
    if (known is None) != (layout.watch_every == 0):
        raise SceneError("watch_every", layout.watch_every, "must be 0 where no peaks are known")
    steps = sum(leg.steps for leg in scene.schedule(layout.step * scene.units.time))
    made = _softening(scene, steps)
    sections = [
        _header(scene, layout, known, steps),
        _parameters(scene, layout, made),
        _granules(layout),
        _consequences(scene, made),
        _law(layout, made),
        *([] if known is None else [_watch()]),
        _trajectory(layout),
        _run(scene, made),
        _final_state() if known is None else _verdict(scene, layout, made, known, steps),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def data_file(scene: Scene, title: str = "a scene") -> str:
    """The granules as a data file, for a deck that reads them from one."""
    chain = scene.chain
    diameter = 2 * chain.radius
    rows = "\n".join(
        f"{i + 1} 1 {diameter!r} {chain.density!r} {i * diameter!r} 0 0"
        for i in range(chain.granules)
    )
    return f"""\
{title}: id, type, diameter [m], density [kg/m^3], x, y, z [m] of each granule

{chain.granules} atoms
1 atom types
{-chain.radius!r} {(chain.granules - 0.5) * diameter!r} xlo xhi
{-chain.radius!r} {chain.radius!r} ylo yhi
{-chain.radius!r} {chain.radius!r} zlo zhi

Atoms # sphere

{rows}
"""


def _softening(scene: Scene, steps: int) -> Softening:
    made = softening(scene, steps)
    return made if made.power < 0 or predicted_loss(scene, steps) > WANTED else NONE


def _comment(text: str) -> list[str]:
    return textwrap.wrap(text, 98, initial_indent="# ", subsequent_indent="# ")


def _header(scene: Scene, layout: Layout, known: KnownAnswer | None, steps: int) -> list[str]:
    run = f"lmp -in {layout.name}"
    # An example that is checked: of these shocks, times stay as they are.
    times = not isinstance(scene.shock, Pulse) or scene.shock.momentum_ratio is None
    example = "watch 1           " if times or layout.atoms == "data" else "young_modulus 70e9"
    changing = "any parameter below is changed"
    if layout.atoms == "data":
        changing = "any but N, R and rho, which stand in the data file, is changed"
    what = (
        f"{layout.title}: a chain of {scene.chain.granules} elastic spheres in Hertz contact,"
        f" pushed at one end. Written by hertzchain {version('hertzchain')} for LAMMPS of 29 Sep"
        " 2021 and later. SI units throughout. Equations are those of Hasan and Nemat-Nasser,"
        " Growth of shock-induced solitary waves in granular crystals."
    )
    lines = [
        *_comment(what),
        "#",
        f"#   {run}                          {steps} steps",
        f"#   mpiexec -n 2 {run}             on two processors, the same result",
        f"#   {run} -var {example}  {changing} like this",
        "#",
    ]
    if known is None:
        text = (
            "Peak forces are not watched. The final state goes to chain.final: id, x [m], vx [m/s],"
            " fx [N]."
        )
        return [*lines, *_comment(text)]
    first = ", ".join(f"{value:.4f}" for value in known.force_ratio[:3])
    last = f", ..., {known.force_ratio[-1]:.4f}" if known.force_ratio.size > 3 else ""
    expected = (
        "The peak force of each contact goes to peaks.csv; contact i lies between granules i - 1"
        " and i. Over F0, the largest applied force, peaks are expected to be"
        f" {first}{last}, right to {known.largest_error:.1e}. The last line says PASS or FAIL (exit"
        " status 1); NOT CHECKED after a change with which F/F0 is not the same any more."
    )
    return [*lines, *_comment(expected)]


def _parameters(scene: Scene, layout: Layout, made: Softening) -> list[str]:
    shock = scene.shock
    lines = ["# ---- Parameters"]
    chain = parameters(scene.chain)
    if layout.atoms == "data":
        chain = [line for line in chain if line.split()[1] in ("young_modulus", "poisson_ratio")]
        lines.append("# Number, size and density of the granules stand in the data file.")
    lines += chain
    if isinstance(shock, Pulse):
        lines += [
            f"variable peak_force index {shock.peak_force!r} # F0 [N]",
            f"variable duration_ratio index {shock.duration_ratio!r} # n: pulse over rise time",
        ]
        if shock.momentum_ratio is not None:
            lines.append(
                f"variable momentum_ratio index {shock.momentum_ratio!r} # LM_ratio: momentum over"
                " that of a wave as high"
            )
        else:
            lines.append(f"variable rise_time index {shock.rise_time!r} # t0 [s]")
    end = "0" if scene.run.end_time is None else repr(scene.run.end_time)
    lines += [
        f"variable end_time index {end} # s; 0: long enough for every contact",
        f"variable step index {layout.step!r} # the longest step, natural time units",
    ]
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
    if made != NONE:
        lines += [
            *_comment(
                "Coordinates of whole granules leave few digits to overlaps as small as here. With"
                " E / 8^k overlaps are 4^k times larger and all times 2^k times longer; forces are"
                " the same."
            ),
            f"variable softening index {made.power} # k; 0: the granules as they are",
        ]
    return [_aligned(line) for line in lines]


def _aligned(line: str) -> str:
    command, mark, comment = line.partition("#")
    return f"{command.rstrip():<44}# {comment.strip()}" if command and mark else line


def _granules(layout: Layout) -> list[str]:
    # Slabs along the chain: any other cut would leave processors without granules.
    lines = ["# ---- The granules, shared out among processors along the chain", *START]
    lines += ["processors * 1 1", ""]
    if layout.atoms == "create":
        return [*lines, *GRANULES]
    return [
        *lines,
        f"read_data {layout.data_file}",
        "variable granules equal $(count(all))",
        "variable radius equal $((bound(all,xmax)-bound(all,xmin))/(2*(v_granules-1)):%.17g)",
        "variable density equal $(mass(all)/(v_granules*4/3*PI*v_radius^3):%.17g)",
    ]


def _consequences(scene: Scene, made: Softening) -> list[str]:
    modulus = "v_young_modulus" if made == NONE else "v_modulus"
    stretch = "" if made == NONE else "v_stretch*"
    lines = ["# ---- What follows from the parameters"]
    if made != NONE:
        lines += [
            "variable stretch equal 2^v_softening",
            "variable modulus equal v_young_modulus/8^v_softening",
        ]
    lines += [
        "# A in F = A overlap^(3/2) (Eq. 1) [N/m^1.5], and m [kg]",
        f"variable stiffness equal sqrt(2*v_radius)*{modulus}/(3*(1-v_poisson_ratio^2))",
        "variable mass equal 4/3*PI*v_radius^3*v_density",
    ]
    shock = scene.shock
    if isinstance(shock, PulseTable):
        lines.append(f"variable peak_force equal {shock.peak_force!r}")
    lines += [
        "# Natural units of length [m] and time [s]: the overlap under F0, and what goes with it",
        "variable unit_length equal (v_peak_force/v_stiffness)^(2/3)",
        "variable unit_time equal sqrt(v_mass*v_unit_length/v_peak_force)",
        "# Momentum of a solitary wave of height F0 (section 4.1) [N s]",
        'variable wave_momentum equal "139/32*v_peak_force^(5/6)* &',
        f'    ((1-v_poisson_ratio^2)*v_radius^4*v_density^1.5/{modulus})^(1/3)"',
    ]
    if isinstance(shock, PulseTable):
        impulse = math.fsum(ramp.impulse for ramp in scene.ramps)
        lines.append(f"variable LM equal {stretch}{impulse!r}/v_wave_momentum")
        pulse_end = f"{stretch}{shock.time[-1]!r}"
    else:
        lines.append("# Rise time t0 [s]: the area of the pulse is F0 n t0 / 2")
        unit = "2*v_wave_momentum/(v_duration_ratio*v_peak_force)"
        if shock.momentum_ratio is not None:
            lines += ["variable LM equal v_momentum_ratio", f"variable t0 equal v_LM*{unit}"]
        else:
            lines += [f"variable t0 equal {stretch}v_rise_time", f"variable LM equal v_t0/({unit})"]
        pulse_end = "v_duration_ratio*v_t0"
    return [
        *lines,
        f"variable pulse_end equal {pulse_end}",
        "# A wave of height 1 runs through 0.9055 granules in a natural time unit.",
        "variable speed equal 0.9055*((v_LM<1)*v_LM+(v_LM>=1))^0.2",
        'if "${end_time} == 0" then &',
        '    "variable end equal v_pulse_end+1.2*(v_granules+5)/v_speed*v_unit_time" &',
        f'else "variable end equal {stretch}v_end_time"',
        "variable longest equal v_step*v_unit_time",
    ]


def _law(layout: Layout, made: Softening) -> list[str]:
    pair = list(PAIR_STYLES[layout.pair_style])
    if made != NONE:
        soft = [("${young_modulus}", "$(v_modulus:%.17g)"), ("v_young_modulus", "v_modulus")]
        for old, new in soft:
            pair = [line.replace(old, new) for line in pair]
    return [
        "# ---- Hertz's law, without damping and friction",
        *(line.replace("stiffness", "normal_stiffness") for line in pair),
        *SKIN,
        *MOTION,
        "thermo 0",
        "# A step is so short that taking the time of its parts would cost a fifth of it.",
        "timer off",
        "",
        "# Is it? Granule 1, pressed against the next by a unit of length (a tenth of R at most),",
        "# has to be pushed back with the force of Eq. 1; by a quarter of it with an eighth of",
        "# that. And the masses have to be m.",
        "variable depth equal &",
        '    "v_unit_length*(v_unit_length<v_radius/10)+v_radius/10*(v_unit_length>=v_radius/10)"',
        "variable answer equal v_stiffness*v_depth^1.5",
        "displace_atoms first move $(v_depth:%.17g) 0 0 units box",
        "run 0 post no",
        "variable pressed equal $(fmax/v_answer-1:%.17g)",
        "displace_atoms first move $(-0.75*v_depth:%.17g) 0 0 units box",
        "run 0 post no",
        "variable pressed_less equal $(8*fmax/v_answer-1:%.17g)",
        "set atom 1 x 0",
        "variable heavier equal $(mass(all)/(v_granules*v_mass)-1:%.17g)",
        "# Positions up to 2R have so many digits, overlaps as much fewer as they are smaller.",
        "variable digits equal 1e-11+1e-14*v_radius/v_depth",
        'variable law equal "(abs(v_pressed)<v_digits)*(abs(v_pressed_less)<v_digits)* &',
        '    (abs(v_heavier)<1e-11)"',
    ]


def _watch() -> list[str]:
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


def _trajectory(layout: Layout) -> list[str]:
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


def _run(scene: Scene, made: Softening) -> list[str]:
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
                lines.append("fix shock first addforce v_force 0.0 0.0")
        elif pushed:
            lines.append("unfix shock")
        pushed = piece.force is not None
        lines.append("run ${steps} post no")
    return lines


def _final_state() -> list[str]:
    return ["write_dump all custom chain.final id x vx fx modify sort id format float %.17g"]


def _verdict(
    scene: Scene, layout: Layout, made: Softening, known: KnownAnswer, steps: int
) -> list[str]:
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
        *_comment(remark),
        *answers,
        "",
        *_comment(cost),
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
        "run 0 post no",
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
    unclear = f"{ROUNDING}*v_lost>{_UNCLEAR}"
    # The highest peaks expected, 5 F0, press three times as deep: below R, from where on second
    # neighbours touch. A softened chain is made as deep as it may be.
    deepest = max(0.3, 1.01 * scene.units.length * made.length / chain.radius)
    changed: list[tuple[str, str, float]] = [
        (unclear, "coordinates may cost more than {} of a peak", _UNCLEAR),
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
