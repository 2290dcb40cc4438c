"""Settings that tests of fits share."""

from __future__ import annotations

import pytest


@pytest.fixture
def few_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Search from one further start: each takes half a second if more than noise is left."""
    monkeypatch.setattr("hertzchain.lab.fit._MOST_STARTS", 1)
