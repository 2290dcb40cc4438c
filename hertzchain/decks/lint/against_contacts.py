"""Contacts and walls of a deck against those of a scene."""

from __future__ import annotations

import math
from itertools import pairwise

from hertzchain.decks.lint.against import CLOSE, Against, contacts_in_order, differs
from hertzchain.decks.lint.contacts import Contact


def contacts(made: Against) -> None:
    """Stiffness and damping of all contacts, the wall's too."""
    row, scene = made.row, made.scene
    if row is None or len(row.ids) != scene.chain.granules:
        return
    found, walls = contacts_in_order(made), made.chain.walls
    if found is None:
        made.not_known("contacts")
        return
    expected = scene.granules.stiffness.tolist()
    radii = scene.granules.radius.tolist()
    reduced = [a * b / (a + b) for a, b in pairwise(radii)]
    diameters = [d or math.nan for d in row.diameter]
    own = [a * b / (a + b) / 2 for a, b in pairwise(diameters)]
    said: set[tuple[int, str]] = set()
    for k, contact in enumerate(found):
        name = f"contact {k + 2}"
        modulus = expected[k] / math.sqrt(reduced[k])
        _law(made, contact, name, modulus, math.sqrt(own[k]), said)
        _damping(made, contact, k, name, said)
    if walls is None:
        made.not_known("walls")
        return
    _walls(made, said)


def _law(
    made: Against,
    contact: Contact,
    name: str,
    modulus: float,
    root: float,
    said: set[tuple[int, str]],
) -> None:
    """Compare K in F = K sqrt(R*) overlap^(3/2), which is 4/3 E*, so that sizes have no part."""
    if contact.stiffness is None:
        made.not_known("stiffness of contacts")
        return
    if contact.exponent != 1.5:
        if (contact.command.line, "law") not in said:
            said.add((contact.command.line, "law"))
            made.say("stiffness", contact.command, f"{name} is a linear spring, not Hertz's law")
        return
    unit = made.scale
    # K has the unit of a pressure; the stiffness of a softer chain is less on purpose.
    found = contact.stiffness / root
    expected = modulus * made.softer / unit.pressure
    key = (contact.command.line, f"{found / expected:.3g}")
    if not differs(found, expected) or key in said:
        return
    said.add(key)
    words = contact.command.words
    advice = f"write 4/3 E* = {expected:.9g} for Kn"
    if "hertz/material" in words:
        young = made.scene.granules.young_modulus.tolist()[0] / unit.pressure
        poisson = made.scene.granules.poisson_ratio.tolist()[0]
        advice = f"write E and nu of the scene ({young:.9g} and {poisson:.9g} in granule 1)"
    text = (
        f"{name} has 4/3 E* = {found:.6g}, {found / expected:.4g} times the scene's"
        f" {expected:.6g}: {advice}"
    )
    made.say("stiffness", contact.command, text, found, expected)


def _damping(
    made: Against, contact: Contact, k: int, name: str, said: set[tuple[int, str]]
) -> None:
    """Compare c in c d^q d' and whether the contact may pull."""
    scene = made.scene
    if contact.damping is None:
        made.not_known("damping of contacts")
        return
    text, found, expected = "", contact.damping, 0.0
    if scene.contact is None:
        if contact.damping:
            text = f"{name} is damped, in the scene it is not: give 0.0 and leave damping out"
    elif not contact.damping:
        text = f'{name} is not damped, in the scene it is: damping = "{scene.contact.damping}"'
    else:
        q = scene.contact.exponent
        unit = made.scale.force / made.velocity / made.depth**q
        assert scene.granules.damping is not None
        expected = scene.granules.damping.tolist()[k] / unit
        if contact.power != q:
            text = (
                f"{name} is damped by overlap^{contact.power:g}, in the scene by overlap^{q:g}"
                f' (damping = "{scene.contact.damping}"): take another damping option'
            )
        elif differs(found, expected):
            text = (
                f"{name} is damped {found / expected:.4g} times as much as in the scene: change"
                " the second number of its law by as much"
            )
        elif contact.may_pull != scene.contact.attraction:
            text = (
                f"{name} may {'' if contact.may_pull else 'not '}pull, in the scene it"
                f" {'may' if scene.contact.attraction else 'may not'}:"
                f" {'leave out' if scene.contact.attraction else 'write'} limit_damping"
            )
    if text and (contact.command.line, text.removeprefix(name)) not in said:
        said.add((contact.command.line, text.removeprefix(name)))
        made.say("damping", contact.command, text, found, expected)


def _walls(made: Against, said: set[tuple[int, str]]) -> None:
    """Compare the wall at the far end: whether there is one, its place and its stiffness."""
    row, scene, walls = made.row, made.scene, made.chain.walls
    assert row is not None
    assert walls is not None
    if scene.wall is None:
        for wall in walls:
            made.say("wall", wall.contact.command, "there is a wall, in the scene there is none")
        return
    if len(walls) != 1:
        text = f"the scene has a wall at the far end, the deck has {len(walls)}"
        command = walls[0].contact.command if walls else None
        made.say("wall", command, text, len(walls), 1)
        return
    (wall,) = walls
    granules, diameter = scene.granules, row.diameter[-1]
    modulus = granules.stiffness.tolist()[-1] / math.sqrt(granules.radius.tolist()[-1])
    _law(made, wall.contact, "the wall", modulus, math.sqrt((diameter or math.nan) / 2), said)
    _damping(made, wall.contact, len(row.ids) - 1, "the wall", said)
    last = row.place[-1]
    if wall.place is None or last is None or diameter is None:
        made.not_known("place of the wall")
        return
    gap = granules.gap.tolist()[-1] - granules.static_overlap.tolist()[-1]
    away = 1 if wall.place > last else -1
    expected = last + away * (diameter / 2 + gap / made.depth)
    if abs(wall.place - expected) * made.depth > CLOSE * scene.units.length:
        text = (
            f"the wall stands at {wall.place:.10g}, in the scene at {expected:.10g} by the place"
            " of the last granule"
        )
        made.say("wall", wall.contact.command, text, wall.place, expected)
