"""Rules of lint on the chain that LAMMPS makes of a deck: steps, forces over time."""

from __future__ import annotations

import numpy as np
import pytest

from tests.verdict.lint.test_lint import CLEAN, TRAPS, lint, planted

pytestmark = pytest.mark.lammps


@pytest.mark.parametrize(("step", "found"), [(0.198, False), (0.202, True)])
def test_from_a_fifth_of_the_natural_time_on_steps_are_long(step: float, found: bool) -> None:
    mass, modulus = np.pi / 6 * 0.0095**3 * 7958, 193e9 / (2 * (1 - 0.3**2))
    stiffness = 4 / 3 * modulus * np.sqrt(0.0095 / 4)
    unit = float(np.sqrt(mass) / (stiffness ** (1 / 3) * 100 ** (1 / 6)))  # under 100 N
    text = CLEAN.replace("unfix shock\nrun 3000", f"timestep {step * unit!r}\nrun 100")
    text = text.replace("fix shock", "fix little first addforce 1e-3 0.0 0.0\nfix shock")
    assert [f.severity for f in lint(text) if f.rule == "step-length"] == ["warning"] * found


def test_static_loads_are_no_staircase_and_push_one_granule_each() -> None:
    held = "".join(f"fix p{k} first addforce {k} 0.0 0.0\n" for k in (1, 2, 3))
    text = CLEAN.replace("timestep 5e-8", f"group last id 30\n{held}timestep 5e-8")
    assert lint(text) == []


def test_messages_have_the_numbers_of_the_deck() -> None:
    def sentence(name: str, rule: str) -> str:
        return next(f.text for f in lint(planted(TRAPS[name])) if f.rule == rule)

    assert "that of granules that collide at 1:" in sentence(
        "unstable steps of a striker", "step-length"
    )
    assert "temperature 1e20" in sentence("thermal velocities", "random-velocities")
    assert "the 10 granules of group first" in sentence("a force on ten", "force-on-all")


def test_an_empty_variable_of_the_caller_is_read() -> None:
    """A command line refuses one."""
    assert {finding.rule for finding in lint("print ${a}\n", {"a": ""})} == {"no-deck"}
