"""Disk cache of compiled kernels: addressed by content, verified by checksum, never trusted.

The name of a file holds a digest of the kernel: its bytecode, all functions and constants that it takes from elsewhere,
its compiler options, numba and the processor. The first bytes of the file are a digest of that identity and of its
content. So a file that is stale, damaged, swapped for another or of another machine is not used.

The files of a checkout stand beside the source. Those of an installed package stand in the cache of the user, in a
folder for each version, so that they outlive the installation: names and digests hold no path and no time of a file.
NUMBA_CACHE_DIR names another folder, for all.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import sys
import time
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any
from uuid import uuid4

import llvmlite
import numba
import numpy as np
from numba.core.caching import FunctionCache, NullCache
from numba.core.serialize import dumps

from impactlab import __version__
from impactlab.startup.wall_time import LOADING, spent_on

DAY = 86400.0  # s; an older half-written file is removed
DIGEST = 32  # bytes of a SHA-256
OF_NUMBA = (b"NRT_", b"_numba_hashsecret_", b"numba_parallel_for")  # begins of names that numba defines as it compiles
SHORT = 16  # hexadecimal digits of a digest in a file name
INSTALLED = {"site-packages", "dist-packages"}  # a folder in the path of an installed package
FOREIGN = ("numba", "numpy", "math", "cmath", "builtins", "llvmlite", "ctypes")  # known by the version of numba
# Errors in rebuilding a kernel whose checksum is right: it is then compiled again.
FAULTS = (EOFError, pickle.UnpicklingError, ValueError, TypeError, AttributeError, ImportError, IndexError, KeyError)


def fingerprint(function: Callable[..., Any], options: Mapping[str, Any]) -> str:
    """Return a digest of a kernel's code and its dependencies.

    These are bytecode, options, and all functions and constants that it takes from elsewhere.
    """
    seen: dict[int, Any] = {}
    parts = [f"numba {numba.__version__} llvmlite {llvmlite.__version__} numpy {np.__version__}", _text(options, seen)]
    return hashlib.sha256("\n".join([*parts, _text(function, seen)]).encode()).hexdigest()


def _text(value: Any, seen: dict[int, Any], names: tuple[str, ...] = ()) -> str:
    """Return a value as text for a digest of compiled code.

    It differs where the code may differ, and is the same in every process.
    """
    match value:
        case None | bool() | int() | float() | complex() | str() | bytes() | np.generic():
            return f"{type(value).__name__} {value!r}"
        case np.ndarray():
            return f"array {value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
        case tuple() | list():
            return f"[{', '.join(_text(item, seen) for item in value)}]"
        case set() | frozenset():
            return f"{{{', '.join(sorted(_text(item, seen) for item in value))}}}"
        case Mapping():
            return f"{{{', '.join(sorted(f'{key}: {_text(item, seen)}' for key, item in value.items()))}}}"
        case CodeType():
            inside = [value.co_code.hex(), *value.co_names, *value.co_varnames, *value.co_freevars]
            return f"code {inside} {_text(value.co_consts, seen)}"
        case ModuleType():
            if value.__name__.partition(".")[0] in FOREIGN:
                return f"module {value.__name__}"
            used = {name: vars(value)[name] for name in names if name in vars(value)}
            return f"module {value.__name__} {_text(used, seen)}"
        case type():
            return f"type {value.__module__}.{value.__qualname__}"
    # A dispatcher, a C callback, an intrinsic: the function that it was made of.
    for attribute in ("py_func", "_pyfunc", "_defn"):
        inner = getattr(value, attribute, None)
        if isinstance(inner, FunctionType):
            return f"{type(value).__name__} {_text(getattr(value, 'targetoptions', None), seen)} {_text(inner, seen)}"
    return _function(value, seen) if isinstance(value, FunctionType) else f"object {type(value).__qualname__}"


def _function(function: FunctionType, seen: dict[int, Any]) -> str:
    if id(function) in seen or function.__module__.partition(".")[0] in FOREIGN:
        return f"function {function.__module__}.{function.__qualname__}"
    seen[id(function)] = function  # kept, so that its id stays its own
    names = _names(function.__code__)
    used = {name: function.__globals__[name] for name in names if name in function.__globals__}
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    taken = ", ".join(f"{name}: {_text(value, seen, names)}" for name, value in sorted(used.items()))
    code = function.__code__
    if function.__doc__ and code.co_consts[:1] == (function.__doc__,):  # a docstring does not change the compiled code
        code = code.replace(co_consts=(None, *code.co_consts[1:]))
    return f"{_text(code, seen)} {_text(function.__defaults__, seen)} {_text(cells, seen)} {taken}"


def _names(code: CodeType) -> tuple[str, ...]:
    """Return the names that a code object and those inside it look up."""
    inner = [name for const in code.co_consts if isinstance(const, CodeType) for name in _names(const)]
    return tuple(sorted({*code.co_names, *inner}))


@cache
def load_array_functions() -> None:
    """Load numba's array functions, as it does before it compiles, but without scipy's BLAS.

    Numba would look for BLAS at once, which takes a third of a second and is needed only by the inner products of
    np.convolve. Products of matrices look for it when they are compiled.
    """
    blas = "scipy.linalg.cython_blas"
    hidden = blas not in sys.modules
    if hidden:
        sys.modules[blas] = None  # type: ignore[assignment] # Python then reports that it cannot be imported
    try:
        with spent_on(LOADING):
            import numba.np.arraymath  # noqa: F401
    finally:
        if hidden:
            del sys.modules[blas]


Cache: Any = FunctionCache
Nothing: Any = NullCache
pickled: Any = dumps


class KernelFile:
    """The files of one kernel, one per signature and processor.

    They are in numba's folder for it.
    """

    def __init__(self, folder: Path, base: str, function: Callable[..., Any], options: Mapping[str, Any]) -> None:
        self.folder, self.base, self._function, self._options = folder, base, function, options
        self._print = ""

    @property
    def fingerprint(self) -> str:
        """Digest of the kernel, computed at its first compilation.

        All functions that it calls are defined then.
        """
        self._print = self._print or fingerprint(self._function, self._options)
        return self._print

    def exists(self) -> bool:
        """Return whether the present kernel is on disk, for any signature."""
        return any(path.is_file() for path in self.folder.glob(f"{self.base}.*.{self.fingerprint[:SHORT]}.nbc"))

    def holds(self, key: Any) -> bool:
        """Return whether there is a file of the present kernel under a key of numba's."""
        return self._place(key)[0].is_file()

    def read(self, key: Any) -> bytes | None:
        """Return the pickled kernel under a key of numba's; None without one.

        None, too, if it is damaged or of another kernel.
        """
        path, identity = self._place(key)
        try:
            data = path.read_bytes()
        except OSError:
            return None
        return data[DIGEST:] if data[:DIGEST] == hashlib.sha256(identity + data[DIGEST:]).digest() else None

    def save(self, key: Any, value: Any) -> None:
        """Store a compiled kernel in place of its older versions.

        If that fails it is not stored.
        """
        path, identity = self._place(key)
        payload: bytes = pickled(value)
        draft = path.with_name(f"{path.name}.{os.getpid()}.{uuid4().hex[:8]}.tmp")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            draft.write_bytes(hashlib.sha256(identity + payload).digest() + payload)
            draft.replace(path)
        except OSError:  # a full disk, a folder in its place: the run continues with the compiled kernel
            with contextlib.suppress(OSError):
                draft.unlink()
            return
        for left in self.folder.glob(f"{self.base}.*.tmp"):  # of processes that were killed
            with contextlib.suppress(OSError):
                if time.time() - left.stat().st_mtime > DAY:
                    left.unlink()
        for older in self.folder.glob(f"{path.name.rsplit('.', 2)[0]}.*.nbc"):
            if older != path:
                with contextlib.suppress(OSError):
                    older.unlink()

    def flush(self) -> None:
        """Remove the files of this kernel."""
        for path in self.folder.glob(f"{self.base}.*.nbc"):
            path.unlink(missing_ok=True)

    def _place(self, key: Any) -> tuple[Path, bytes]:
        signature, machine, _ = key
        called = hashlib.sha256(f"{signature} {machine}".encode()).hexdigest()
        name = f"{self.base}.{called[:SHORT]}.{self.fingerprint[:SHORT]}.nbc"
        return self.folder / name, f"{self.base} {called} {self.fingerprint}".encode()


def folder_of(module: str, source: Path, beside: Path) -> Path:
    """Return the folder for the kernels of a module.

    It follows from its source; ``beside`` is the one that numba would take.
    """
    shared = os.environ.get("NUMBA_CACHE_DIR")
    if shared:
        return Path(shared, "impactlab", module)
    if not INSTALLED.intersection(source.parts):
        return beside
    try:
        folder = user_cache() / "impactlab" / f"{__version__}-numba-{numba.__version__}" / module
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # no home, as in a container
        return beside
    return folder if os.access(folder, os.W_OK) else beside


def user_cache() -> Path:
    """Return the folder in which the user's programs keep files that can be made again."""
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


class KernelCache(Cache):  # type: ignore[misc] # numba has types in some versions
    """Numba's cache of one function, with our files."""

    keeps = True

    def __init__(self, function: Callable[..., Any], options: Mapping[str, Any]) -> None:
        super().__init__(function)
        folder = folder_of(function.__module__, Path(function.__code__.co_filename), Path(self._cache_path))
        self._cache_file = KernelFile(folder, self._impl.filename_base, function, options)
        self._is_alone = options.get("_nrt") is False  # it calls nothing of numba's runtime for objects

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function of a signature, None if it must be compiled.

        Numba would first load all that it may need to compile, which takes a tenth of a second.
        """
        with contextlib.suppress(*FAULTS), self._guard_against_spurious_io_errors():
            if (found := self._load_overload(sig, target_context)) is not None:
                return found
        load_array_functions()  # needed by the code compiled next
        return None

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        """The same, with an error where the file holds something else."""
        data = self._cache_file.read(self._index_key(sig, target_context.codegen())) if self._enabled else None
        if data is None:
            return None
        if not self._is_alone or any(symbol in data for symbol in OF_NUMBA):
            load_array_functions()
            target_context.refresh()
        return self._impl.rebuild(target_context, pickle.loads(data))  # noqa: S301 - verified, written here

    def holds(self, sig: Any, target_context: Any) -> bool:
        """Return whether a compiled function of a signature is on disk."""
        return bool(self._enabled) and self._cache_file.holds(self._index_key(sig, target_context.codegen()))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store the compiled function of a signature if there is a place for it."""
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)


class NoCache(Nothing):  # type: ignore[misc] # numba has types in some versions
    """A cache that keeps nothing."""

    keeps = False

    def holds(self, _sig: Any, _target_context: Any) -> bool:
        """Return that nothing is on disk."""
        return False


def cache_of(function: Callable[..., Any], options: Mapping[str, Any]) -> Any:
    """Return the disk cache of a function.

    It stores nothing if there is no file, as at a prompt.
    """
    try:
        return KernelCache(function, options)
    except (RuntimeError, OSError):
        load_array_functions()
        return NoCache()


class LaterCache:
    """The disk cache of a function, made on first use.

    A command uses few of the functions that it imports. To make one, numba writes a file into its folder and removes
    it.
    """

    def __init__(self, function: Callable[..., Any], options: Mapping[str, Any]) -> None:
        self._given = function, options
        self._made: Any = None

    def __getattr__(self, name: str) -> Any:
        if self._made is None:
            self._made = cache_of(*self._given)
        return getattr(self._made, name)


def kept(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return the decorator that compiles a function with these options of numba's, kept on disk."""
    compiling: Any = numba.njit(**options)

    def decorated(function: Callable[..., Any]) -> Any:
        made = compiling(function)
        if isinstance(getattr(made, "py_func", None), FunctionType):  # not with compilation switched off
            made._cache = LaterCache(function, options)
        return made

    return decorated


def digest_of(made: Any) -> str:
    """Return the digest of a function that numba made.

    It is that of its files, if it is kept on disk.
    """
    files = getattr(made._cache, "_cache_file", None)
    return files.fingerprint if isinstance(files, KernelFile) else fingerprint(made.py_func, made.targetoptions)


def is_missing(entry: Any) -> bool:
    """Return whether the present kernel is not on disk, where it could be kept."""
    files = getattr(getattr(entry, "_cache", None), "_cache_file", None)
    return isinstance(files, KernelFile) and not files.exists()


def is_kept(entry: Any) -> bool:
    """Return whether the present kernel is on disk.

    Its first call then does not compile it.
    """
    files = getattr(getattr(entry, "_cache", None), "_cache_file", None)
    return isinstance(files, KernelFile) and files.exists()
