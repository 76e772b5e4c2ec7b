"""Code of parts, functions that compiled functions alone call: kept as LLVM's intermediate code.

Numba makes machine code of every function that it compiles, also of a part, which it then copies into each caller and
optimises there once more. A part needs the second alone, so that compiling takes three quarters of the time. Where a
part has a wrapper for Python after all, its machine code is made when that is first needed.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator
from typing import Any

import llvmlite.binding as llvm
from numba.core.bytecode import FunctionIdentity
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock, require_global_compiler_lock

Library: Any = JITCodeLibrary
Identity: Any = FunctionIdentity
locked: Any = require_global_compiler_lock
compiler_lock: Any = global_compiler_lock
parsed: Any = llvm.parse_bitcode
IN_BITCODE = "bitcode"  # numba's word for a kernel on disk that holds intermediate code alone
SHORT = 12  # hexadecimal digits of a digest in a name


class WithoutEnvironments:
    """Numba's code generator for a part.

    It has no code of its own that could look for its Python environment.
    """

    def __init__(self, generator: Any) -> None:
        self._generator = generator

    def __getattr__(self, name: str) -> Any:
        return getattr(self._generator, name)

    def set_env(self, _name: str, _environment: Any) -> None:
        """Set nothing."""


class PartLibrary(Library):  # type: ignore[misc] # numba has types in some versions
    """Code of a part and its callees as intermediate code.

    It stays so until machine code is needed.
    """

    _waits = False

    @property
    def codegen(self) -> Any:
        """Numba's code generator."""
        return WithoutEnvironments(self._codegen) if self._waits else self._codegen

    def finalize(self) -> None:
        """Include the code of called functions; nothing can be added afterwards."""
        locked()
        self._raise_if_finalized()
        for library in dict.fromkeys(self._linking_libraries):
            if hasattr(library, "_reload_init"):  # from numba 0.63 on
                self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = self._waits = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function, 0 if not here.

        That is the case for the wrapper which a part does not have.
        """
        self._ensure_finalized()
        if self._waits:
            if not any(each.name == name and not each.is_declaration for each in self._final_module.functions):
                return 0
            self._make_machine_code()
        return int(super().get_pointer_to_function(name))

    def serialize_using_object_code(self) -> tuple[str, str, Any]:
        """Return the state for the disk: the intermediate code, if there is no other."""
        found: tuple[str, str, Any] = (
            self.serialize_using_bitcode() if self._waits else super().serialize_using_object_code()
        )
        return found

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple[str, str, Any]) -> Any:
        name, kind, data = state
        if kind != IN_BITCODE:
            return super()._unserialize(codegen, state)
        made = codegen.create_library(name)
        made._final_module = parsed(data)
        made._finalized = made._waits = True
        return made

    def _make_machine_code(self) -> None:
        self._waits = False
        self._optimize_final_module()
        self._final_module.verify()
        self._finalize_final_module()


@contextlib.contextmanager
def as_parts(generator: Any) -> Iterator[None]:
    """Make code parts of the functions that numba compiles inside.

    They may also be loaded by the generator; one thread at a time is inside.
    """
    with compiler_lock:
        before = generator._library_class
        generator._library_class = PartLibrary
        try:
            yield
        finally:
            generator._library_class = before


@contextlib.contextmanager
def named_by(digest: str) -> Iterator[None]:
    """Name the function that is compiled inside by its digest.

    This is a digest of its content, in hexadecimal digits. Numba numbers functions in the order in which a process
    compiles them. Of a part that another process has compiled, too, a caller would then hold two copies under two
    names, and its machine code, and the last bits of its sums, would follow from the order in which code was compiled.
    Functions that are compiled for the one inside keep numbers.
    """
    with compiler_lock:
        before = Identity._unique_ids
        Identity._unique_ids = itertools.chain((int(digest[:SHORT], 16),), before)
        try:
            yield
        finally:
            Identity._unique_ids = before
