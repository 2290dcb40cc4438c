"""A scene, and the numbers of a right deck of it."""

from __future__ import annotations

import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.found import FoundDeck
from tests.verdict.deck.corpus import scene_of
from tests.verdict.deck.made import found


@pytest.fixture(scope="module")
def scene() -> hc.Scene:
    return scene_of("steel")


@pytest.fixture(scope="module")
def right(scene: hc.Scene) -> FoundDeck:
    """A deck that is the scene."""
    return found(scene)
