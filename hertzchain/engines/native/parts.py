"""How functions that kernels call are compiled: once, with the kernel.

Numba makes machine code of every function by itself, with two entries for callers outside, and
again in each function that calls it. A part stays as it was written until a kernel has it.
"""

from __future__ import annotations

from typing import Any

from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import AnalysisPass, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import AnnotateTypes


class _NoEngine:
    """The engine of code that is not run: it has no address where an environment is kept."""

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing: only what raises errors, prints or takes Python objects asks for that."""


class _Part(JITCodeLibrary):
    """Code that is linked into the kernels and optimised there."""

    codegen = _NoEngine()

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, _: str) -> int:
        """0: no function has machine code."""
        self._ensure_finalized()
        return 0


@register_pass(mutates_CFG=False, analysis_only=True)
class _AsPart(AnalysisPass):
    """Choose where the code of a function goes."""

    _name = "hertzchain_as_part"

    def __init__(self) -> None:
        AnalysisPass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Nothing of the function changes."""
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        return False


class _Compiler(CompilerBase):
    def define_pipelines(self) -> list[Any]:
        """Numba's own steps, and the choice before the last of them."""
        builder: Any = DefaultPassBuilder
        steps = builder.define_nopython_pipeline(self.state)
        steps.add_pass_after(_AsPart, AnnotateTypes)
        steps.finalize()
        return [steps]


class _CalledAsWritten(CPUDispatcher):
    """What kernels see as compiled; Python, for which there is no machine code, runs the source."""

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def compiled_as_part(function: Any, **options: Any) -> Any:
    """A function that kernels call, with options of ``njit``."""
    alone = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": _Compiler}
    made = njit(**options, **alone)(function)
    if isinstance(made, CPUDispatcher):  # Numba can be told to compile nothing
        made.__class__ = _CalledAsWritten
    return made
