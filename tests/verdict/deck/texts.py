"""Texts with numbers, whose last digits depend on the C library."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from hertzchain.verdict.deck.places import SIZES


def assert_alike(texts: Sequence[str], expected: Sequence[str]) -> None:
    """Assert that texts are equal but for the last digits of their numbers.

    Powers and roots may differ in their last digit from one C library to another, and sums of them
    by a few more: 2e-11 is what decks of ours are allowed, too.
    """
    one, other = "\n".join(texts), "\n".join(expected)
    assert SIZES.sub("#", one) == SIZES.sub("#", other), one
    numbers, wanted = ([float(size) for size in SIZES.findall(text)] for text in (one, other))
    assert numbers == pytest.approx(wanted, rel=2e-11, abs=0)
