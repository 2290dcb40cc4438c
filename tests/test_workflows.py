"""The workflow files name existing targets of the Makefile and supported Pythons."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.places import ROOT

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def jobs(workflow: Path) -> dict[str, Any]:
    document = yaml.safe_load(workflow.read_text(encoding="utf-8"))["jobs"]
    assert isinstance(document, dict)
    return document


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_targets_are_in_the_makefile_and_no_job_may_write_to_the_repository(workflow: Path) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    text = workflow.read_text(encoding="utf-8")
    named = re.findall(r"\bmake ([a-z-]+)", text)
    assert named or workflow.stem == "release"
    assert set(named) <= targets
    assert yaml.safe_load(text)["permissions"] == {"contents": "read"}
    for name, job in jobs(workflow).items():
        published = (workflow.stem, name) == ("release", "publish")
        assert job.get("permissions") == ({"id-token": "write"} if published else None)


def test_every_supported_python_is_tried_on_both_systems() -> None:
    (tests,) = (path for path in WORKFLOWS if path.stem == "tests")
    matrix = jobs(tests)["tests"]["strategy"]["matrix"]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    prefix = "Programming Language :: Python :: "
    supported = [
        name.removeprefix(prefix) for name in project["classifiers"] if name.startswith(prefix)
    ]
    assert matrix["python"] == [name for name in supported if "." in name]
    assert matrix["os"] == ["ubuntu-latest", "macos-latest"]


def test_actions_of_others_are_named_by_their_hash() -> None:
    used = {
        step["uses"]
        for workflow in WORKFLOWS
        for job in jobs(workflow).values()
        for step in job["steps"]
        if "uses" in step
    }
    others = [action for action in used if not action.startswith("actions/")]
    assert len(others) == 1
    assert all(re.fullmatch(r"[^@]+@[0-9a-f]{40}", action) for action in others)
