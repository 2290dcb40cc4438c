"""A scene as one LAMMPS deck that runs, and judges itself, without Python: pure text.

``-var`` overrides every parameter; derived quantities are formulas in the deck. Peak forces, from
the largest overlaps, are divided by F0 and compared with the true ones: by similarity these hold
for all granules and forces with the same LM_ratio, n and N.
"""

from __future__ import annotations

from importlib.metadata import version

from hertzchain.decks import standalone_run, standalone_terms
from hertzchain.decks.layout import WANTED, KnownAnswer, Layout
from hertzchain.engines.external.rescaling import NONE, Softening, predicted_loss, softening
from hertzchain.engines.lammps.deck import GRANULES, MOTION, SKIN, START, parameters
from hertzchain.engines.lammps.dialect import NO_STEP, OLDEST, PAIR_STYLES, write_dump
from hertzchain.errors import SceneError
from hertzchain.scene.scene import Scene
from hertzchain.scene.validity import refuse_terms

_OVERLAP = "(id<${granules})*(2*$(v_radius:%.17g)+x-c_ahead)"
"""LAMMPS formula of the overlap between a granule and the next one [m]."""


def standalone(scene: Scene, layout: Layout, known: KnownAnswer | None = None) -> str:
    """Return a deck for ``lmp -in FILE``, on any processors; ``known`` is None for lean decks.

    RunFailed for a layout that is impossible with terms.
    """
    if (known is None) != (layout.watch_every == 0):
        raise SceneError("watch_every", layout.watch_every, "must be 0 where no peaks are known")
    if not scene.is_plain:
        return standalone_terms.deck(scene, layout, known)
    steps = sum(leg.steps for leg in scene.schedule(layout.step * scene.units.time))
    made = softening(scene, steps)
    if made.power >= 0 and predicted_loss(scene, steps) <= WANTED:
        made = NONE
    sections = [
        _header(scene, layout, known, steps),
        _parameters(scene, layout, made),
        _granules(layout),
        _consequences(scene, made),
        _law(layout, made),
        *([] if known is None else [standalone_run.watch_commands(_OVERLAP)]),
        standalone_run.trajectory_commands(layout),
        standalone_run.run_commands(scene, made),
        [write_dump("chain.final", ("x", "vx", "fx"))]
        if known is None
        else standalone_run.verdict_commands(scene, layout, made, known, steps),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines) + "\n"


def data_file(scene: Scene, title: str = "a scene") -> str:
    """Return the granules as a data file, for a deck that reads them from one."""
    refuse_terms(scene, "a data file")
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


def _header(scene: Scene, layout: Layout, known: KnownAnswer | None, steps: int) -> list[str]:
    run = f"lmp -in {layout.name}"
    # Not F0 for these shocks, whose times would stay the same: the example has to be checked.
    times = scene.pulse is None or scene.pulse.momentum_ratio is None
    example = "watch 1           " if times or layout.atoms == "data" else "young_modulus 70e9"
    changing = "any parameter below is changed"
    if layout.atoms == "data":
        changing = "any but N, R and rho, which stand in the data file, is changed"
    what = (
        f"{layout.title}: a chain of {scene.chain.granules} elastic spheres in Hertz contact,"
        f" pushed at one end. Written by hertzchain {version('hertzchain')} for LAMMPS of"
        f" {OLDEST} and later. SI units throughout. Equations are those of Hasan and Nemat-Nasser,"
        " Growth of shock-induced solitary waves in granular crystals."
    )
    lines = [
        *standalone_run.comment(what),
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
        return [*lines, *standalone_run.comment(text)]
    first = ", ".join(f"{value:.4f}" for value in known.force_ratio[:3])
    last = f", ..., {known.force_ratio[-1]:.4f}" if known.force_ratio.size > 3 else ""
    expected = (
        "The peak force of each contact goes to peaks.csv; contact i lies between granules i - 1"
        " and i. Over F0, the largest applied force, peaks are expected to be"
        f" {first}{last}, right to {known.largest_error:.1e}. The last line says PASS or FAIL (exit"
        " status 1); NOT CHECKED after a change with which F/F0 is not the same any more."
    )
    return [*lines, *standalone_run.comment(expected)]


def _parameters(scene: Scene, layout: Layout, made: Softening) -> list[str]:
    pulse = scene.pulse
    lines = ["# ---- Parameters"]
    chain = parameters(scene.chain)
    if layout.atoms == "data":
        chain = [line for line in chain if line.split()[1] in ("young_modulus", "poisson_ratio")]
        lines.append("# Number, size and density of the granules stand in the data file.")
    lines += chain
    if pulse is not None:
        lines += [
            f"variable peak_force index {pulse.peak_force!r} # F0 [N]",
            f"variable duration_ratio index {pulse.duration_ratio!r} # n: pulse over rise time",
        ]
        if pulse.momentum_ratio is not None:
            lines.append(
                f"variable momentum_ratio index {pulse.momentum_ratio!r} # LM_ratio: momentum over"
                " that of a wave as high"
            )
        else:
            lines.append(f"variable rise_time index {pulse.rise_time!r} # t0 [s]")
    end = "0" if scene.run.end_time is None else repr(scene.run.end_time)
    lines += [
        f"variable end_time index {end} # s; 0: long enough for every contact",
        *standalone_run.parameters(layout),
    ]
    if made != NONE:
        lines += [
            *standalone_run.comment(
                "Coordinates of whole granules leave few digits to overlaps as small as here. With"
                " E / 8^k overlaps are 4^k times larger and all times 2^k times longer; forces are"
                " the same."
            ),
            f"variable softening index {made.power} # k; 0: the granules as they are",
        ]
    return [standalone_run.aligned(line) for line in lines]


def _granules(layout: Layout) -> list[str]:
    # Slabs along the chain: any other division would leave processors without granules.
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
    pulse = scene.pulse
    if pulse is None:
        lines.append(f"variable peak_force equal {scene.peak_force!r}")
    lines += [
        "# Natural units of length [m] and time [s]: the overlap under F0, and what goes with it",
        "variable unit_length equal (v_peak_force/v_stiffness)^(2/3)",
        "variable unit_time equal sqrt(v_mass*v_unit_length/v_peak_force)",
        "# Momentum of a solitary wave of height F0 (section 4.1) [N s]",
        'variable wave_momentum equal "139/32*v_peak_force^(5/6)* &',
        f'    ((1-v_poisson_ratio^2)*v_radius^4*v_density^1.5/{modulus})^(1/3)"',
    ]
    if pulse is None:
        lines.append(f"variable LM equal {stretch}{scene.impulse!r}/v_wave_momentum")
        pulse_end = f"{stretch}{scene.pulse_end!r}"
    else:
        lines.append("# Rise time t0 [s]: the area of the pulse is F0 n t0 / 2")
        unit = "2*v_wave_momentum/(v_duration_ratio*v_peak_force)"
        if pulse.momentum_ratio is not None:
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
        NO_STEP,
        "variable pressed equal $(fmax/v_answer-1:%.17g)",
        "displace_atoms first move $(-0.75*v_depth:%.17g) 0 0 units box",
        NO_STEP,
        "variable pressed_less equal $(8*fmax/v_answer-1:%.17g)",
        "set atom 1 x 0",
        "variable heavier equal $(mass(all)/(v_granules*v_mass)-1:%.17g)",
        "# Positions up to 2R have so many digits, overlaps as much fewer as they are smaller.",
        "variable digits equal 1e-11+1e-14*v_radius/v_depth",
        'variable law equal "(abs(v_pressed)<v_digits)*(abs(v_pressed_less)<v_digits)* &',
        '    (abs(v_heavier)<1e-11)"',
    ]
