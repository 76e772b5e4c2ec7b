"""The folder of a bench: all or nothing of each file, one bench at a time, and nobody else's folder."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from impactlab import CaseError
from impactlab.bench.store import LOCK, Store, opened
from impactlab.jobs.files import DRAFT

HOLD = "import sys, time; from pathlib import Path; from impactlab.bench.store import opened\n"
HOLD += "with opened(Path(sys.argv[1])): print('held', flush=True); time.sleep(60)"


def test_a_record_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    record = {"x": 0.1 + 0.2, "none": None, "text": "müller"}
    with opened(tmp_path / "deep" / "bench") as store:
        store.put("rows", "k", record)
        assert store.get("rows", "k") == record
        assert store.get("times", "k") is None
        assert [path.name for path in (tmp_path / "deep" / "bench" / "rows").iterdir()] == ["k.json"]
        session = store.session
        assert session.is_dir()
    assert not session.exists()


def test_files_cut_short_are_deleted_and_never_read(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        store.put("rows", "whole", {"a": 1})
    (tmp_path / "rows" / f"half.json{DRAFT}").write_text('{"a":')
    (tmp_path / "rows" / "torn.json").write_text('{"a":')
    (tmp_path / "rows" / "empty.json").write_bytes(b"\x00\xff")
    (tmp_path / "session-1").mkdir()
    with opened(tmp_path) as store:
        assert not list(tmp_path.rglob(f"*{DRAFT}"))
        assert not (tmp_path / "session-1").exists()
        assert [store.get("rows", key) for key in ("whole", "half", "torn", "empty")] == [{"a": 1}, None, None, None]
        assert [path.name for path in (tmp_path / "rows").iterdir()] == ["whole.json"]


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(tmp_path) as store:
        store.put("rows", "k", {"a": 1})
        with monkeypatch.context() as patched:
            patched.setattr(Path, "replace", lambda self, target: (_ for _ in ()).throw(KeyboardInterrupt))
            with pytest.raises(KeyboardInterrupt):
                store.put("rows", "k", {"a": 2})
        assert store.get("rows", "k") == {"a": 1}
        with pytest.raises(ValueError, match="not JSON compliant"):
            store.put("rows", "k", {"a": float("nan")})  # a row holds finite numbers or null
        assert json.loads((tmp_path / "rows" / "k.json").read_text()) == {"a": 1}


def test_a_second_bench_is_refused_and_the_lock_dies_with_its_owner(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(CaseError, match="another bench is at work") as told, opened(tmp_path):
            pass
        assert "--out" in told.value.remedy
        assert (tmp_path / f"session-{holder.pid}").is_dir()  # the one that was refused swept nothing
        holder.kill()
    with opened(tmp_path):
        assert [path.name for path in tmp_path.glob("session-*")] == [f"session-{os.getpid()}"]


def test_a_folder_of_somebody_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(CaseError, match=r"holds files that no bench wrote, such as 'thesis.tex'"), opened(tmp_path):
        pass
    assert sorted(path.name for path in tmp_path.iterdir()) == ["thesis.tex"]
    with pytest.raises(CaseError, match="is not a folder"), opened(tmp_path / "thesis.tex"):
        pass


def test_an_open_store_holds_its_lock(tmp_path: Path) -> None:
    with opened(tmp_path) as store:
        assert isinstance(store, Store)
        assert (tmp_path / LOCK).is_file()
