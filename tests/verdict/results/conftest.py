"""A run of the scene, and its peaks."""

from __future__ import annotations

import pytest

import hertzchain as hc
from hertzchain.arrays import FloatArray
from tests.verdict.results.runs import SCENE, Samples, sampled


@pytest.fixture(scope="module")
def truth() -> FloatArray:
    return hc.Native("reference").run(SCENE).peak_force


@pytest.fixture(scope="module")
def run() -> Samples:
    return sampled(SCENE, 0.1)
