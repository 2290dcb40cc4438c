"""LAMMPS is asked in this process: a second less."""

from __future__ import annotations

from pathlib import Path

import pytest

from hertzchain.engines.lammps.reading import reading


@pytest.fixture(autouse=True)
def _asked_here(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    def here(path: Path, given: dict[str, str], _: float) -> reading.Look:
        start = reading.Start(tmp_path_factory.mktemp("LAMMPS"), None, alone=False)
        return reading.looked(start, path, Path.cwd(), given)

    monkeypatch.setattr(reading, "look", here)
