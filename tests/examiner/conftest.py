"""A scene, and the numbers of a right deck of it."""

from __future__ import annotations

import pytest

import hertzchain as hc
from hertzchain.engines.lammps.reading.deck import FoundDeck
from tests.examiner.corpus import scene_of
from tests.examiner.made import found


@pytest.fixture(scope="module")
def scene() -> hc.Scene:
    return scene_of("steel")


@pytest.fixture(scope="module")
def right(scene: hc.Scene) -> FoundDeck:
    """A deck that is the scene."""
    return found(scene)
