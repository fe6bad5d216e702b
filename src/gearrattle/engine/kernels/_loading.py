"""Machine code from numba's cache, loaded without the LLVM text that is stored with it.

numba parses the text of every kernel that it loads, which takes half of the loading time. The text is needed only when
a kernel that calls this one is compiled; so it is parsed then. numba needs the names that the text defines: they are
stored with it.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import llvmlite.binding as llvm
from numba.core.caching import CompileResultCacheImpl
from numba.core.codegen import JITCodeLibrary


class _Library(JITCodeLibrary):
    """Machine code whose LLVM text is read when it is first needed."""

    text: bytes

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = llvm.parse_bitcode(self.text)
        return super()._get_module_for_linking()


class Kept(CompileResultCacheImpl):
    """What the cache stores of a compiled kernel."""

    def reduce(self, data: Any) -> Any:
        """Return the data to store: those of numba, and the names that are defined."""
        module = data.library._get_module_for_linking()
        defined = {v.name for some in (module.functions, module.global_variables) for v in some if not v.is_declaration}
        return defined, super().reduce(data)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Return the stored kernel, ready to run."""
        defined, ((name, kind, (code, text)), *others) = payload
        target_context.codegen()._engine._defined_symbols.update(defined)
        rebuilt = super().rebuild(target_context, ((name, kind, (code, _no_text())), *others))
        library: Any = rebuilt.library
        library.__class__ = _Library
        library.text = text
        library._shared_module = None
        return rebuilt


@cache
def _no_text() -> bytes:
    return llvm.parse_assembly("").as_bitcode()  # type: ignore[no-any-return]
