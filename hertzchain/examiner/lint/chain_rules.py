"""Rules of lint on granules, motion, shock and steps, which depend on several lines."""

from __future__ import annotations

import math
import re

from hertzchain.engines.lammps.reading.text import number
from hertzchain.examiner.lint.deck import Command, Deck, Found

# ---- Granules

_TOUCHING = 1e-9  # relative; sites that differ by less from a diameter differ by rounding

_DENSITY = (
    "the density is set before the diameter, so that granules keep the mass that the old diameter"
    " made (1e6 times too large for a radius of 5 mm, and only the first one moves): set the"
    " diameter first, then the density"
)


def density_before_diameter(deck: Deck) -> Found:
    """The mass is made when the density is set, with the diameter of that moment."""
    last = max((command.place for command, _ in deck.given("density")), default=-1)
    first = min((command.place for command, _ in deck.given("diameter")), default=-1)
    pending: Command | None = None
    for command in deck.named("set"):
        words = command.words
        if "density" in words:
            both = "diameter" in words[words.index("density") :]
            if both:
                yield command, "error", _DENSITY
            pending = None if both or "diameter" in words else command
        elif "diameter" in words and pending is not None:
            covers = pending.words[1:3] == words[1:3] or "all" in (words[2], pending.words[2])
            if covers and last < command.place:
                if first < pending.place:
                    yield command, "warning", _DENSITY
                else:
                    yield pending, "error", _DENSITY
            pending = None


def diameter_missing(deck: Deck) -> Found:
    """Granules that are created have diameter 1 and density 1."""
    created = deck.named("create_atoms")
    brought = deck.named("read_data", "molecule") or deck.is_partial
    given = {word for command in deck.named("set") for word in command.words}
    lacks = "diameter" if "diameter" not in given else "density"
    if not created or brought or not deck.is_granular or deck.no_chain:
        return
    if not {"density", "mass"} & given or lacks == "diameter":
        text = (
            f"no {lacks} is set: granules that are created have diameter 1 and the mass 0.5236 of"
            " density 1, in the units of the deck; write set group all diameter ..., then set group"
            " all density ..."
        )
        yield created[0], "error", text


_HELD = 1e15  # kg/m^3; granules of a larger density are heavy to stay in place (chosen)


def unusual_density(deck: Deck) -> Found:
    """Densities that may have a wrong unit, by the usual range of scenes, which are in SI."""
    given = [(command, number(value)) for command, value in deck.given("density")]
    if deck.units != "si" or not given:
        return
    from hertzchain.scene.scene import unusual

    for command, density in given:
        remark = unusual("chain.density", density)
        if remark and density is not None and density < _HELD:
            yield command, "note", f"perhaps a wrong unit: {remark.removeprefix('chain.')}"


def ghost_velocity(deck: Deck) -> Found:
    """Contact laws of granules ask for the velocities of ghosts."""
    wanted = any(command.after("vel") == "yes" for command in deck.named("comm_modify"))
    if deck.is_granular and not wanted and not deck.is_partial:
        text = (
            "comm_modify vel yes is missing: pair styles of granules need the velocities of ghost"
            " granules, and LAMMPS stops at the first run; write it before the pair style"
        )
        yield deck.pair_style, "error", text


def periodic(deck: Deck) -> Found:
    """Images of a chain that meet it, or are ghosts that cost time."""
    granules = deck.granules
    if granules is None or deck.skin is None:
        return
    where = deck.boundary or next(iter(deck.named("create_box", "read_data")), None)
    room = 2 * (2 * float(granules.radius.max()) + deck.skin)
    box, place = granules.high - granules.low, granules.position
    is_flat = any(command.word(1) == "2" for command in deck.named("dimension"))
    for k, direction in enumerate(granules.frame):
        name = "xyz"[int(abs(direction).argmax())]
        narrow = box[k] <= place[:, k].max() - place[:, k].min() + room
        if granules.periodic[k] and narrow and not (is_flat and name == "z"):  # as LAMMPS wants it
            what = (
                "every granule has images as ghosts, and a step takes twice as long" if k
                else "the chain has no free ends, the last granule meets the first"
            )  # fmt: skip
            text = (
                f"{name} is periodic, as all sides are by default, and the box is narrow: {what};"
                " write boundary f f f with room around the chain"
            )
            yield where, "warning", text


def not_touching(deck: Deck) -> Found:
    """Granules of a chain touch without force, unless gaps and loads are intended."""
    granules = deck.granules
    made = deck.named("lattice", "create_atoms", "read_data", "displace_atoms")
    if granules is None or not deck.is_granular or not made:
        return
    gap = (granules.position[1:, 0] - granules.position[:-1, 0]) / granules.reach - 1
    is_meant = deck.is_loaded or granules.velocity.any()
    text = "neighbours are {:.10g} times the sum of their radii apart: granules {}"
    if gap.max() > _TOUCHING:
        what = "do not touch (with gaps of 1e-3 peaks are off by 113 %)"
        yield made[0], "warning", text.format(1 + gap.max(), what)
    if gap.min() < -_TOUCHING and not is_meant:
        what = "press one another from the start, and spring apart if nothing holds the ends"
        yield made[0], "warning", text.format(1 + gap.min(), what)


# ---- What moves them

_MOVER = re.compile(r"(nve|nvt|npt|nph|rigid|move$|brownian|ehex|controller|python|freeze)")


def motion(deck: Deck) -> Found:
    """Exactly one fix has to move each granule."""
    if deck.is_of_liggghts:
        return
    movers = [fix for fix in deck.fixes() if _MOVER.match(fix.words[3])]
    is_whole = deck.pair_style is not None and not deck.is_partial and not deck.no_chain
    if deck.runs and not movers and is_whole:
        text = "no fix moves the granules, nothing happens: write fix motion all nve"
        yield deck.runs[0], "error", text
    gone = {command.word(1): command.place for command in deck.named("unfix")}
    seen: dict[str, Command] = {}
    for fix in movers:
        other = seen.get(fix.words[2], fix)
        is_gone = other.place < gone.get(other.word(1), -1) < fix.place
        if other.word(1) != fix.word(1) and not is_gone:
            text = (
                f"granules of group {fix.words[2]} are moved twice each step, here and by fix"
                f" {other.word(1)} (peaks off by 20 %): keep one"
            )
            yield fix, "error", text
        seen[fix.words[2]] = fix


def lattice_units(deck: Deck) -> Found:
    """Velocities are in lattice spacings per unit of time, unless ``units box`` is given.

    A ``v_name`` is in units of the deck (LAMMPS's documentation of ``velocity``).
    """
    spacing: Command | None = None
    for command in deck.named("lattice", "velocity", "fix"):
        if command.name == "lattice":
            spacing = command
            continue
        given = {"set": command.words[3:6], "ramp": command.words[4:6]}.get(command.word(2), ())
        if command.name == "fix":
            given = command.words[5:8] if command.words[3:5] == ("move", "linear") else ()
        is_scaled = any(number(word) for word in given) and command.after("units") != "box"
        if is_scaled and spacing is not None and number(spacing.word(2)) != 1:
            text = (
                "without units box LAMMPS multiplies these velocities by the spacing of"
                f" {' '.join(spacing.words[:3])}: write units box at the end"
            )
            yield command, "warning", text


def force_frozen(deck: Deck) -> Found:
    """A formula that is evaluated only once is a constant."""
    formulas = {c.word(1): " ".join(c.words[3:]) for c in deck.named("variable")}
    for fix in deck.fixes("addforce", "setforce"):
        for word in fix.raw[4:7]:
            match = re.fullmatch(r"\$\{(\w+)\}|\$\(\s*v_(\w+)\s*(?::[^)]*)?\)", word)
            name = match and (match[1] or match[2])
            if name and re.search(r"\b(step|time|elapsed|elaplong)\b", formulas.get(name, "")):
                text = (
                    f"{word} is filled in once, when the line is read: the force stays at the"
                    f" value of that moment; write v_{name}, which follows the time"
                )
                yield fix, "error", text


def force_on_all(deck: Deck) -> Found:
    """A shock hits one end; an atom-style variable gives each granule a force of its own."""
    each = {
        f"v_{command.word(1)}" for command in deck.named("variable") if command.word(2) == "atom"
    }
    for fix in deck.fixes("addforce"):
        if each & {*fix.words[4:7]}:
            continue
        largest = None if fix.index is None else deck.pushes.get(fix.index)
        zero = all(number(word) == 0 or word == "NULL" for word in fix.words[4:7])
        many = "every granule" if fix.word(2) == "all" and not zero else None
        if largest is not None:
            count = int((largest.max(axis=1) > 0).sum())
            many = f"the {count} granules of group {fix.word(2)}" if count > 1 else None
        if many:
            text = (
                f"the force acts on {many}, on each in full: group first id 1, and fix"
                f" {fix.word(1)} first addforce, push one end"
            )
            yield fix, "warning", text


# ---- Steps

_UNSTABLE = math.sqrt(2 / 3)  # natural time units; 2 over the largest frequency, 2 sqrt(3/2)
_LONG = 0.2  # natural time units; peaks are then off by 1 % (chosen)


def step_length(deck: Deck) -> Found:
    """Compare the step with the stiffest contacts that the deck itself makes."""
    granules, look = deck.granules, deck.look
    law = None if look is None else look.law
    if granules is None or look is None or law is None:
        return
    if not look.runs or deck.fixes("dt/reset"):
        return
    import numpy as np
    from scipy.linalg import eigvalsh_tridiagonal

    from hertzchain.contact import hertz

    (stiffness, exponent), mass = law, granules.mass
    if not np.all(np.abs(exponent - 1.5) < 0.01) or np.any(mass <= 0):
        return
    pressing = max((push.max() for push in deck.pushes.values()), default=0.0)
    origin = "the largest force of this deck"
    speed = np.abs(np.diff(granules.velocity[:, 0]))
    reduced = mass[1:] * mass[:-1] / (mass[1:] + mass[:-1])
    hits = hertz.impact_force(stiffness, reduced, speed)
    if hits.max() > pressing:
        pressing = hits.max()
        origin = f"that of granules that collide at {speed[hits.argmax()]:g}"
    if not pressing:
        return
    spring = hertz.slope_of(stiffness, pressing)
    both = np.append(spring, 0) + np.append(0, spring)
    squares = eigvalsh_tridiagonal(
        both / mass, -spring / np.sqrt(mass[1:] * mass[:-1]),
        select="i", select_range=(len(mass) - 1, len(mass) - 1),
    )  # fmt: skip
    limit = 2 / math.sqrt(squares[0])
    unit, longest = limit / _UNSTABLE, max(look.runs, key=lambda run: run.dt)
    run = deck.carried_out(longest.command)
    steps = [c for c in deck.named("timestep") if run is not None and c.place < run.place]
    step, what = longest.dt / unit, f"contacts pressed by {pressing:.4g}, {origin}"
    text = f"{0.02 * unit:.1g} gives peaks right to about 1e-4"
    if longest.dt > limit:
        text = (
            f"the step {longest.dt:.3g} is above the limit of stability, {limit:.3g} for {what}:"
            f" granules fly apart; {text}"
        )
        yield steps[-1] if steps else run, "error", text
    elif step > _LONG:
        text = (
            f"the step {longest.dt:.3g} is {step:.2g} of the natural time of {what}: peaks are"
            f" off by about {0.22 * step**2:.1%}, which goes with the square of it; {text}"
        )
        yield steps[-1] if steps else run, "warning", text


RULES = (
    density_before_diameter, diameter_missing, unusual_density, ghost_velocity, periodic,
    not_touching, motion, lattice_units, force_frozen, force_on_all, step_length,
)  # fmt: skip
