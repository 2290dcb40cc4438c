"""Fixtures that tests of several commands share."""

from __future__ import annotations

import functools
from pathlib import Path

import pandas as pd
import pytest

from hertzchain.verdict import tradeoff
from tests.cli.short_chain import CONTACTS, scene_file
from tests.command_line import Outcome, process
from tests.processes import names


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty current folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="session")
def native(tmp_path_factory: pytest.TempPathFactory) -> Outcome:
    """`run --json` with everything by default, and a table of peaks."""
    there = tmp_path_factory.mktemp("native")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(there)
        scene_file()
        outcome = process("run", "scene.toml", "--json", "-o", there / "peaks.csv")
        assert names() == ["peaks.csv", "scene.toml"]
    peaks = pd.read_csv(there / "peaks.csv")
    assert peaks.columns.tolist() == ["contact", "peak_force_N", "peak_time_s"]
    assert peaks["contact"].tolist() == list(range(2, 2 + CONTACTS))
    document = outcome.json()
    assert peaks["peak_force_N"].tolist() == document["peak_force_N"]
    assert peaks["peak_time_s"].tolist() == document["peak_time_s"]
    return outcome


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """No run is repeated for the sake of its time, and the slow ones are left out."""
    engines = ("compiled", "LAMMPS")
    quick = functools.partial(tradeoff.tradeoff, engines=engines, enough=0.0)
    monkeypatch.setattr(tradeoff, "tradeoff", quick)


@pytest.fixture
def no_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    """LIGGGHTS and Yade are not there, whether or not they are installed."""
    monkeypatch.setenv("PATH", "")
