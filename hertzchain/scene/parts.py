"""All parts of a scene, by the sections of its file, and all keys: the only lists of them."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

from hertzchain.errors import require
from hertzchain.scene.chain import Chain
from hertzchain.scene.gauge import Gauge
from hertzchain.scene.keys import Key, keys_of
from hertzchain.scene.moving import Moving
from hertzchain.scene.piston import Piston
from hertzchain.scene.pulse import Pulse, PulseTable
from hertzchain.scene.run import Run
from hertzchain.scene.segments import OF_SEGMENT
from hertzchain.scene.shock import Shock
from hertzchain.scene.sine import Sine
from hertzchain.scene.striker import Striker
from hertzchain.scene.terms import Contact, Precompression, Wall
from hertzchain.scene.uncertain import SECTIONS_OF_UNCERTAIN

SHOCKS: tuple[type[Shock], ...] = (Pulse, PulseTable, Striker, Piston, Sine, Moving)
"""All shocks: one entry each."""

OF_PROFILE = {
    name: shock for shock in SHOCKS if shock.section == "shock" for name in shock.profiles
}
"""Shocks by their names in ``profile`` of a section [shock]."""

OTHERS: dict[str, type] = {
    "wall": Wall,
    "near_wall": Wall,
    "precompression": Precompression,
    "contact": Contact,
    "run": Run,
}
"""Parts that a scene may have next to its chain and its shock, by section."""

_OF_SHOCKS = {one.section for one in SHOCKS if one.section}

SECTIONS = tuple(sorted({"chain", "gauge", *_OF_SHOCKS, *OTHERS, *SECTIONS_OF_UNCERTAIN}))

_PARTS = [
    ("chain", Chain),
    *((shock.section, shock) for shock in SHOCKS),
    *OTHERS.items(),
    ("gauge", Gauge),
]

KEYS: dict[str, Key] = {
    f"{section}.{name}": key for section, part in _PARTS for name, key in keys_of(part).items()
}
"""All keys by section and name, as ``chain.radius``."""

SEGMENT = re.compile(r"(?:chain\.)?segments\.(\d+)\.(?:cell\.(\d+)\.)?(\w+)")
"""The name of a key of a segment: its number, that of a granule of its cell, the key."""


def full_names(name: object, known: Iterable[str], preferred: Collection[str] = ()) -> list[str]:
    """Return the full name of a key that is given with or without its section; none if unknown.

    If several sections have the key, a preferred one is taken, else a SceneError lists them.
    """
    found = [one for one in known if name in (one, one.partition(".")[2] or one)]
    if len(found) > 1:
        found = [one for one in found if one in preferred] or found
    allowed = f"is in several sections: name one of {', '.join(found)}"
    require(len(found) <= 1, str(name), None, allowed)
    return found


def key_named(name: str) -> Key | None:
    """Return the key of a name, with or without its section, also of a segment; None for none.

    The same name has the same unit in every section.
    """
    if (found := SEGMENT.fullmatch(name)) is not None:
        return OF_SEGMENT.get(found[3])
    known = (key for full, key in KEYS.items() if name in (full, full.partition(".")[2]))
    return next(known, None)
