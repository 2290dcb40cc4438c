"""Scripts of validation/ run from a clone whatever way hertzchain is installed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command_line import python
from tests.places import ROOT

_AS_A_SCRIPT = """
import runpy, sys
script, root, site = sys.argv[1:]
own = [path for path in sys.path if path not in ("", root)]  # an editable install adds the clone
sys.path[:] = [script.rpartition("/")[0], site, *own]
sys.argv = [script, "--help"]
runpy.run_path(script, run_name="__main__")
"""
"""What ``python SCRIPT --help`` does where hertzchain alone is installed, in a folder."""


@pytest.mark.slow
@pytest.mark.parametrize("script", ["table2.py", "physics/published.py", "run_all.py"])
def test_a_script_needs_the_package_alone(script: str, tmp_path: Path) -> None:
    (tmp_path / "hertzchain").symlink_to(ROOT / "hertzchain")
    path = ROOT / "validation" / script
    # -P and -E: neither this folder nor what the tests have set leads to the clone.
    done = python("-P", "-E", "-c", _AS_A_SCRIPT, path, ROOT, tmp_path, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("usage: ")
