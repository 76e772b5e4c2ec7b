"""The disk cache of compiled kernels: whatever stands in its files, a run gives the same bits or compiles again."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import FunctionType

import numba
import numpy as np
import pytest

from impactlab import __version__
from impactlab.numerics.cache import KernelFile, fingerprint, folder_of
from tests.support import ROOT

KERNELS = """
import numpy as np
from impactlab.numerics.compiling import ENTRY, HELPER, PART
from impactlab.numerics.linear import solve_banded

@HELPER
def halved(x):
    return 0.5 * x

@PART
def summed(values):
    total = 0.0
    for value in values:
        total += halved(value)
    return total

@ENTRY
def solved(system):
    solve_banded(system, 2, 1)
    return summed(system[:, 2])

print(solved(np.array([[3.0, 1.0, 1.0], [1.0, 3.0, 2.0]])).hex(), halved(1.0 / 3.0).hex())
"""
NAMES = """
import sys
from impactlab.numerics.compiling import ENTRY, HELPER, PART

@HELPER
def doubled(x):
    return 2.0 * x

@PART
def squared(x):
    return x * x

@ENTRY
def fourth(x):
    return squared(squared(x)) + doubled(x)

if "other code first" in sys.argv:
    doubled(1.0)
fourth(1.0)
print([each.fndesc.mangled_name for made in (doubled, squared) for each in made.overloads.values()])
"""
FINGERPRINTS = """
from impactlab.exact import march
from impactlab.simulate.stepping import located, loop
for kernel in (loop.start, loop.advance_dated, located.advance_located, march.advance):
    print(kernel._cache._cache_file.fingerprint)
"""
COMPILER = """
import sys
import numpy as np
from impactlab.numerics.addresses import kernel_address, FREE
from impactlab.numerics.compiling import ENTRY

def with_arrays(values, state):
    made = np.zeros(2)
    state[0] = values[0] + made[1]

@ENTRY
def doubled(x):
    return 2.0 * x

doubled(1.0)
asked = "numba.np.npyimpl" in sys.modules
kernel_address(with_arrays, FREE)
print(asked, "numba.np.npyimpl" in sys.modules)
"""
KEY = ("signature", "machine", "bytecode")
SCALE = 2.0


def helper(x: float) -> float:
    return SCALE * x


def kernel(x: float) -> float:
    return helper(x) + 1.0


def with_globals(function: FunctionType, **changed: object) -> FunctionType:
    """Return a function that finds other things under some global names."""
    return FunctionType(function.__code__, {**function.__globals__, **changed}, function.__name__)


def other_helper(x: float) -> float:
    return SCALE * x + 1e-9


def documented_helper(x: float) -> float:
    """Return the value of a helper."""
    return SCALE * x + 2e-9


def reworded_helper(x: float) -> float:
    """Return it in other words."""
    return SCALE * x + 2e-9


def test_a_kernel_keeps_its_old_code_when_a_function_or_constant_that_it_uses_changes() -> None:
    def digest(changed: FunctionType) -> str:
        return fingerprint(changed, {"fastmath": {"reassoc", "contract"}})

    first = digest(kernel)
    assert digest(with_globals(kernel)) == first
    assert digest(with_globals(kernel, helper=documented_helper)) == digest(
        with_globals(kernel, helper=reworded_helper)
    )
    assert digest(with_globals(kernel, helper=other_helper)) != first
    assert digest(with_globals(kernel, helper=with_globals(helper, SCALE=3.0))) != first
    assert digest(with_globals(kernel, helper=with_globals(helper, SCALE=np.ones(2)))) != first
    assert fingerprint(kernel, {"fastmath": {"contract"}}) != first
    assert fingerprint(kernel, {"fastmath": {"contract", "reassoc"}}) == first


@pytest.fixture
def kept(tmp_path: Path) -> KernelFile:
    made = KernelFile(tmp_path, "loop.kernel-1.py311", kernel, {})
    made.save(KEY, b"code of the kernel")
    return made


def only(folder: Path) -> Path:
    (path,) = folder.glob("loop.kernel-1.*.nbc")
    return path


def test_a_kernel_is_read_back(kept: KernelFile) -> None:
    assert pickle.loads(kept.read(KEY) or b"") == b"code of the kernel"
    assert kept.exists()
    assert kept.read(("another signature", *KEY[1:])) is None


def test_a_kernel_from_disk_loads_its_callees_only_when_it_calls_them(tmp_path: Path) -> None:
    script = tmp_path / "kernels.py"
    script.write_text(COMPILER, encoding="utf-8")
    env = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kernels")}  # whatever an earlier run has left elsewhere
    run = partial(subprocess.run, [sys.executable, script], env=env, capture_output=True, text=True, check=True)
    said = [run() for _ in range(2)]
    assert [each.stdout.split() for each in said] == [["True", "True"], ["False", "True"]]


def test_a_kernel_swapped_for_another_is_called(tmp_path: Path, kept: KernelFile) -> None:
    other = KernelFile(tmp_path, "loop.other-9.py311", other_helper, {})
    other.save(KEY, b"code of another kernel")
    (foreign,) = tmp_path.glob("loop.other-9.*")
    only(tmp_path).write_bytes(foreign.read_bytes())
    assert kept.read(KEY) is None


@pytest.mark.parametrize("damage", [lambda data: data[:40], lambda data: b"", lambda data: data[:-1] + b"\0"])
def test_a_damaged_kernel_is_called(tmp_path: Path, kept: KernelFile, damage: Callable[[bytes], bytes]) -> None:
    path = only(tmp_path)
    path.write_bytes(damage(path.read_bytes()))
    assert kept.read(KEY) is None
    kept.save(KEY, b"compiled again")
    assert pickle.loads(kept.read(KEY) or b"") == b"compiled again"


def test_a_folder_in_the_place_of_a_kernel_ends_the_run(tmp_path: Path, kept: KernelFile) -> None:
    path = only(tmp_path)
    path.unlink()
    path.mkdir()
    (path / "occupied").touch()
    assert kept.read(KEY) is None
    kept.save(KEY, b"compiled again")
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


def test_kernels_of_older_code_stay_on_disk_for_good(tmp_path: Path, kept: KernelFile) -> None:
    newer = KernelFile(tmp_path, "loop.kernel-1.py311", other_helper, {})
    assert not newer.exists()
    newer.save(KEY, b"code of the newer kernel")
    assert kept.read(KEY) is None
    assert only(tmp_path).is_file()


def test_kernels_of_an_installed_package_stand_in_a_folder_of_the_user_by_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr("impactlab.numerics.cache.user_cache", lambda: tmp_path)
    beside = tmp_path / "__pycache__"
    assert folder_of("a.b", tmp_path / "checkout" / "a" / "b.py", beside) == beside
    homes = [tmp_path / env / "lib" / "site-packages" / "a" / "b.py" for env in ("old", "new")]
    first, second = (folder_of("a.b", home, beside) for home in homes)
    assert first == second == tmp_path / "impactlab" / f"{__version__}-numba-{numba.__version__}" / "a.b"
    (tmp_path / "file").touch()
    monkeypatch.setattr("impactlab.numerics.cache.user_cache", lambda: tmp_path / "file")  # no folder
    assert folder_of("a.b", homes[0], beside) == beside
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "shared"))
    assert folder_of("a.b", homes[0], beside) == tmp_path / "shared" / "impactlab" / "a.b"


def started(*command: str, cwd: Path, seed: str = "0", **variables: str | None) -> subprocess.Popen[str]:
    given = {"NUMBA_CACHE_DIR": str(cwd), "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT), **variables}
    environment = {key: value for key, value in (os.environ | given).items() if value is not None}
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, *command], cwd=cwd, env=environment, stdout=pipe, stderr=pipe, text=True)


def result(process: subprocess.Popen[str]) -> str:
    """Return what a process printed, once it ended well."""
    printed, errors = process.communicate(timeout=600)
    assert process.returncode == 0, errors[-2000:]
    return printed


@pytest.mark.slow
def test_two_cold_processes_disturb_each_other_and_a_bad_file_ends_the_next(tmp_path: Path) -> None:
    (tmp_path / "kernels.py").write_text(KERNELS)

    def run(seed: str = "0") -> subprocess.Popen[str]:
        return started("-m", "kernels", cwd=tmp_path, seed=seed)

    both = [run(), run()]
    first, second = map(result, both)
    assert first == second
    assert not list(tmp_path.rglob("*.tmp"))
    files = sorted(tmp_path.rglob("*.nbc"))
    assert len(files) >= 4
    contents = [path.read_bytes() for path in files]
    stamps = [path.stat().st_mtime_ns for path in files]
    assert result(run(seed="1")) == first
    assert [path.stat().st_mtime_ns for path in files] == stamps  # nothing was compiled again
    half = len(files) // 2
    for path, other in zip(files[:half], contents[1 : half + 1], strict=True):  # each holds another kernel
        path.write_bytes(other)
    for path in files[half:]:
        path.unlink()
        path.mkdir()
    assert result(run()) == first


@pytest.mark.slow
def test_compiled_code_outlives_a_reinstall_of_the_same_version(tmp_path: Path) -> None:
    home = tmp_path / "user"

    def installed(environment: str) -> str:
        """Install into another place, with another time of the file; return what a process there prints."""
        packages = tmp_path / environment / "site-packages"
        packages.mkdir(parents=True)
        (packages / "kernels.py").write_text(KERNELS)
        os.utime(packages / "kernels.py", (1e9, 1e9 + len(environment)))
        cache: dict[str, str | None] = {"NUMBA_CACHE_DIR": None, "XDG_CACHE_HOME": str(home)}
        printed = result(started("-m", "kernels", cwd=packages, **cache))
        shutil.rmtree(packages)
        return printed

    first = installed("old")
    files = sorted(home.rglob("__main__/*.nbc"))
    assert len(files) >= 3
    stamps = [path.stat().st_mtime_ns for path in files]
    assert installed("another") == first
    assert sorted(home.rglob("__main__/*.nbc")) == files
    assert [path.stat().st_mtime_ns for path in files] == stamps  # nothing was compiled again


@pytest.mark.slow
def test_the_names_of_the_loops_files_differ_from_process_to_process(tmp_path: Path) -> None:
    one, other = (started("-c", FINGERPRINTS, cwd=tmp_path, seed=seed) for seed in ("0", "1"))
    assert result(one) == result(other)


@pytest.mark.slow
def test_parts_are_named_by_the_order_in_which_a_process_compiles(tmp_path: Path) -> None:
    (tmp_path / "names.py").write_text(NAMES)
    said = []
    for order in ("as they are called", "other code first"):
        (tmp_path / order).mkdir()
        said.append(result(started("-m", "names", order, cwd=tmp_path, NUMBA_CACHE_DIR=str(tmp_path / order))))
    assert "doubled" in said[0] and "squared" in said[0]  # noqa: PT018
    assert said[0] == said[1]
