"""Rules of lint on the granules of a deck: how they are made, where they lie, their neighbours."""

from __future__ import annotations

from hertzchain.verdict.lint.deck import Deck, Found
from hertzchain.verdict.lint.script import Command, number

_TOUCHING = 1e-9  # relative; sites that differ by less from a diameter differ by rounding


def _density_before_diameter(deck: Deck) -> Found:
    """The mass is made when the density is set, with the diameter of that moment."""
    pending: Command | None = None
    last = max((command.place for command, _ in deck.given("density")), default=-1)
    first = min((command.place for command, _ in deck.given("diameter")), default=-1)
    for command in deck.named("set"):
        density, diameter = command.after("density"), command.after("diameter")
        words = command.words
        if density is not None and (
            diameter is None or words.index("density") > words.index("diameter")
        ):
            pending = command if diameter is None else None
        elif density is not None:
            yield command, "error", _DENSITY
            pending = None
        elif diameter is not None and pending is not None:
            covers = pending.words[1:3] == words[1:3] or "all" in (words[2], pending.words[2])
            if covers and last < command.place and first < pending.place:
                yield command, "warning", _LATER
            elif covers and last < command.place:
                yield pending, "error", _DENSITY
            pending = None


_DENSITY = (
    "the density is set before the diameter, so that granules keep the mass that the old diameter"
    " made (1e6 times too large for a radius of 5 mm, and only the first one moves): set the"
    " diameter first, then the density"
)

_LATER = (
    "this diameter is set after the density: these granules keep the mass that the diameter before"
    " made; set their density again behind it, if their mass should follow"
)


def _diameter_missing(deck: Deck) -> Found:
    """Granules that are created have diameter 1 and density 1."""
    created = deck.named("create_atoms")
    brought = deck.named("read_data", "molecule") or deck.is_partial
    if not created or brought or not deck.is_granular or deck.no_chain:
        return
    given = {word for command in deck.named("set") for word in command.words}
    if "diameter" not in given:
        text = (
            "no diameter is set: granules that are created have diameter 1 in the units of the"
            " deck; write set group all diameter ..., then density ..."
        )
        yield created[0], "error", text
    elif not {"density", "mass"} & given:
        text = (
            "no density is set: granules keep the mass 0.5236 that diameter 1 and density 1 made,"
            " whatever their diameter is now; write set group all density ... after the diameter"
        )
        yield created[0], "error", text


def _ghost_velocity(deck: Deck) -> Found:
    """Contact laws of granules ask for the velocities of ghosts."""
    wanted = any(command.after("vel") == "yes" for command in deck.named("comm_modify"))
    if deck.is_granular and not wanted and not deck.is_partial:
        text = (
            "comm_modify vel yes is missing: pair styles of granules need the velocities of ghost"
            " granules, and LAMMPS stops at the first run; write it before the pair style"
        )
        yield deck.pair_style, "error", text


def _units(deck: Deck) -> Found:
    """Numbers that do not belong to the units."""
    if not deck.is_granular or deck.is_partial or deck.units != "lj":
        return
    moduli = [number(law.numbers[0]) for law in deck.laws if law.normal == "hertz/material"]
    real = [modulus for modulus in moduli if modulus is not None and modulus >= 1e8]
    sizes = [number(word) for _, word in deck.given("diameter")]
    if real and any(size is not None and size < 0.2 for size in sizes):
        command = next(iter(deck.named("units")), None)
        said = "units lj" if command else "without a units command they are lj"
        text = (
            f"{said}, but E = {real[0]:g} and the diameter look like SI: skin (0.3), step (0.005)"
            " and lattice (a density, not a spacing) mean something else there; write units si"
        )
        yield command, "error", text


def _periodic(deck: Deck) -> Found:
    """Images of a chain that meet it, or are ghosts that cost time."""
    command = deck.boundary
    granules = deck.granules
    where = command or next(iter(deck.named("create_box", "read_data")), None)
    said = "" if command else " (without a boundary command all are)"
    if granules is None or deck.skin is None:
        return
    room = 2 * (2 * float(granules.radius.max()) + deck.skin)
    box, place = granules.high - granules.low, granules.position
    names = ["xyz"[int(abs(direction).argmax())] for direction in granules.frame]
    is_flat = any(command.word(1) == "2" for command in deck.named("dimension"))
    narrow = [
        granules.periodic[k]
        and not (is_flat and name == "z")  # LAMMPS wants it so
        and box[k] <= place[:, k].max() - place[:, k].min() + room
        for k, name in enumerate(names)
    ]
    across = [name for name, is_narrow in zip(names[1:], narrow[1:], strict=True) if is_narrow]
    if across:
        text = (
            f"{' and '.join(sorted(across))} {'are' if len(across) > 1 else 'is'} periodic{said}:"
            " every granule has images as ghosts if the box is narrow, and a step takes twice as"
            " long (8.3 instead of 3.8 us for 30 granules); write boundary f f f with room around"
            " the chain"
        )
        yield where, "warning", text
    if narrow[0]:
        text = (
            f"{names[0]} is periodic{said}: the chain has no free ends where the box is not longer"
            " than it, the last granule meets the first; write boundary f f f with room at both"
            " ends"
        )
        yield where, "warning", text


def _not_touching(deck: Deck) -> Found:
    """Granules of a chain touch without force, but for gaps and loads that are meant."""
    granules = deck.granules
    if granules is None or not deck.is_granular:
        return
    gap = (granules.position[1:, 0] - granules.position[:-1, 0]) / granules.reach - 1
    widest, deepest = float(gap.max()), float(gap.min())
    made = deck.named("lattice", "create_atoms", "read_data", "displace_atoms")
    if not made:
        return
    if widest > _TOUCHING:
        text = (
            f"neighbours are up to {1 + widest:.10g} times the sum of their radii apart: granules"
            f" do not touch, gaps of {widest:.1e} of a diameter (with 1e-3 peaks are off by 113 %)"
        )
        yield made[0], "warning", text
    if deepest < -_TOUCHING and not (deck.is_loaded or granules.velocity.any()):
        text = (
            f"neighbours are down to {1 + deepest:.10g} times the sum of their radii apart:"
            f" granules press one another from the start, overlaps of {-deepest:.1e} of a diameter,"
            " and spring apart if nothing holds the ends (with 1e-3 peaks are off by 92 %)"
        )
        yield made[0], "warning", text


RULES = (
    _units, _density_before_diameter, _diameter_missing, _not_touching,
    _periodic, _ghost_velocity,
)  # fmt: skip
