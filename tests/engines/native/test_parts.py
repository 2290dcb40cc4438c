"""Functions that are compiled with the kernels that call them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit, types
from numba.core.registry import cpu_target

from hertzchain.engines.native.parts import compiled_as_part


def third(x: Any) -> Any:
    return x / 3


@pytest.mark.parametrize(("how", "has_code"), [(compiled_as_part, False), (njit, True)])
def test_a_part_has_no_machine_code_of_its_own(how: Any, has_code: bool) -> None:
    function: Any = how(third)
    function.compile((types.float64,))
    name = function.overloads[(types.float64,)].fndesc.llvm_func_name
    assert cpu_target.target_context.codegen()._engine.is_symbol_defined(name) == has_code


def test_kernels_with_parts_of_parts() -> None:
    inner: Any = compiled_as_part(third)
    outer: Any = compiled_as_part(lambda x, i: inner(x[i]) + 1)

    def kernel(x: Any) -> Any:
        total = 0.0
        for i in range(x.size):
            total += outer(x, i)
        return total

    assert njit(kernel)(np.arange(4.0)) == pytest.approx(6.0, rel=1e-15, abs=0)


def test_python_runs_the_source_of_a_part() -> None:
    assert compiled_as_part(lambda x: x + "b")("a") == "ab"
