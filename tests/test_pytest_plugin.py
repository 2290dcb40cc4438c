"""The fixture for the tests of other projects, in projects that are made for the purpose."""

from __future__ import annotations

import json
import re

import pytest
from _pytest.assertion.rewrite import AssertionRewriter
from rich.console import Console

import hertzchain as hc
from hertzchain import shown
from hertzchain.report.console import print_document
from hertzchain.report.contents import of_judgement
from tests.command_line import python
from tests.docs.test_docs import blocks
from tests.places import ROOT

PAGE = (ROOT / "docs" / "pytest.md").read_text(encoding="utf-8")
SCENE = (ROOT / "validation" / "scenes" / "demo.toml").read_text(encoding="utf-8")
OPTIONS = ("-p", "no:cacheprovider", "-W", "error")

FIVE_LINES = next(block.text for block in blocks(PAGE) if block.language == "python")

TRUE = """
    import hertzchain as hc

    def peak_forces(factor=1.0, stiffer=1.0):
        from dataclasses import replace
        from pathlib import Path

        scene = hc.Scene.from_toml(Path(__file__).parent / "scene.toml")
        shock = replace(scene.shock, momentum_ratio=None, rise_time=scene.rise_time)
        chain = replace(scene.chain, young_modulus=stiffer * scene.chain.young_modulus)
        return factor * hc.Native(rtol=1e-8).run(hc.Scene(chain, shock)).peak_force
"""


@pytest.fixture(scope="module")
def _all_is_loaded(demo_reference: hc.Result) -> None:
    """An inner session unloads its modules at its end, and NumPy cannot be loaded twice."""
    wrong = hc.judge(demo_reference.scene, demo_reference.peak_force[::-1])
    print_document(Console(quiet=True), of_judgement(wrong))


@pytest.fixture
def project(_all_is_loaded: None, pytester: pytest.Pytester) -> pytest.Pytester:
    """A project with a scene, and a code whose peaks are right by default."""
    (pytester.path / "scene.toml").write_text(SCENE, encoding="utf-8")
    pytester.makepyfile(my_code=TRUE)
    return pytester


def test_the_five_lines_of_the_page_work(project: pytest.Pytester) -> None:
    project.makepyfile(FIVE_LINES)
    project.runpytest_inprocess(*OPTIONS).assert_outcomes(passed=1)


def test_a_failure_is_that_of_the_page(
    project: pytest.Pytester, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # as CI systems do
    wrong = FIVE_LINES.replace("peak_forces()", "peak_forces(stiffer=2.0)")
    project.makepyfile(test_my_code=wrong)
    result = project.runpytest_inprocess(*OPTIONS, "--color=no")
    result.assert_outcomes(failed=1)
    (shown,) = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
    told = [line.removeprefix("E").strip() for line in result.outlines]
    unsteady = "error of native"  # its rounding errors are those of the machine
    for line in shown.splitlines()[1:]:
        assert line.removeprefix("E").strip() in told or unsteady in line
    text = "\n".join(told)
    assert "Likely cause: contact stiffness 2 times that of the scene" in text
    assert "Verdict: fail" in text
    # No line of hertzchain's own code, and none wider than asked for plus pytest's margin.
    assert "pytest_plugin.py" not in text
    assert "Traceback" not in text
    table = [line for line in result.outlines if line.startswith("E  ")][1:]
    assert max(map(len, table)) <= len("E       ") + 100


def test_what_it_takes_and_returns(project: pytest.Pytester) -> None:
    project.makepyfile(
        """
        from pathlib import Path

        import hertzchain as hc
        from my_code import peak_forces

        HERE = Path(__file__).parent

        def test_scenes(judge_peaks):
            peaks = peak_forces()
            for scene in ("scene.toml", HERE / "scene.toml"):
                assert judge_peaks(scene, peaks).verdict == "pass"
            judgement = judge_peaks(hc.Scene.from_toml(HERE / "scene.toml"), peaks, dt=2e-7)
            assert judgement.expected.dt == 2e-7
            assert judgement.tolerance == 1e-3

        def test_peaks(judge_peaks):
            peaks = peak_forces()
            assert judge_peaks("scene.toml", {2: peaks[0], 9: peaks[7]}).missing == 57
            lines = [f"{contact},{peak}" for contact, peak in enumerate(peaks, start=2)]
            text = "\\n".join(["contact,peak_force_N", *lines])
            (HERE / "peaks.csv").write_text(text)
            assert judge_peaks("scene.toml", "peaks.csv").missing == 0
        """
    )
    # Paths are relative to the test's file, not to where pytest is started.
    below = project.mkdir("elsewhere")
    project.chdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(below)
        project.runpytest_inprocess(*OPTIONS, str(project.path)).assert_outcomes(passed=2)


UNUSABLE = {
    '"no.toml", {2: 1.0}': "*no.toml: cannot be read (No such file or directory)*",
    '"scene.toml", "no.csv"': "*no.csv: cannot be read (No such file or directory)*",
    "None, {2: 1.0}": "*must be*Scene*",
}


def test_what_cannot_be_used_is_one_sentence(project: pytest.Pytester) -> None:
    tests = [
        f"def test_{k}(judge_peaks):\n    judge_peaks({call})" for k, call in enumerate(UNUSABLE)
    ]
    project.makepyfile("\n\n".join(tests))
    result = project.runpytest_inprocess(*OPTIONS, "--color=no")
    result.assert_outcomes(failed=len(UNUSABLE))
    told = [line for line in result.outlines if line.startswith("E  ")]
    assert len(told) == len(UNUSABLE), told
    result.stdout.fnmatch_lines([f"E*Failed: hertzchain: {words}" for words in UNUSABLE.values()])


def test_loading_it_loads_nothing_but_itself_and_does_not_warn() -> None:
    code = """
import json, sys
import pytest
before = set(sys.modules)
import hertzchain.pytest_plugin
print(json.dumps(sorted(set(sys.modules) - before)))
"""
    done = python("-c", code, check=True)
    loaded = {"hertzchain", "hertzchain.pytest_plugin"}
    assert set(json.loads(done.stdout)) == loaded
    for module in (hc, shown):
        assert AssertionRewriter.is_rewrite_disabled(module.__doc__ or "")
