"""Tools that plant a mistake in the text for LAMMPS, or in the code that backends share."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import hertzchain as hc
from hertzchain.engines.lammps import deck

POSITION = "lammps: place of granules [m]"
STIFFNESS = "lammps: stiffness of the contacts [N m^-1.5]"
DAMPING = "lammps: damping [N]"

Plant = Callable[[], AbstractContextManager[Any]]
"""A context with a mistake in it."""


@dataclass(frozen=True)
class Mistake:
    """A mistake to plant."""

    what: str
    plant: Plant
    check: str  # the check of the comparison that has to name it
    pair_style: str = "granular"  # context that makes it
    read_every: int | None = None  # steps between two readings of LAMMPS; None for its own choice
    made_in: Callable[[], hc.Scene] | None = None  # the scene; None for that of ``small_scene``


def in_set_up(*changes: tuple[str, str]) -> Plant:
    """Replace text in the commands that create the chain."""

    def planted() -> AbstractContextManager[Any]:
        original = deck.set_up

        def altered(*arguments: Any) -> str:
            text = original(*arguments)
            for old, new in changes:
                if old not in text:
                    raise ValueError(f"there is no {old!r} to get wrong")
                text = text.replace(old, new)
            return text

        return patch.object(deck, "set_up", altered)

    return planted
