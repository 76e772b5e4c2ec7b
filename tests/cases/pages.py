"""The pages docs/how-to-*.md: their blocks, and a registry that knows the part of a page."""

from __future__ import annotations

import importlib
import re
import sys
import tomllib
from pathlib import Path
from typing import Any

from impactlab.plugins import Entry, Registry, installed_entries
from tests.support import DOCS


class Page:
    """A page whose first Python block is a part, whose toml block registers it, whose yaml block is a case with it."""

    def __init__(self, name: str) -> None:
        self._text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
        self._module = f"newcomer_{name.rpartition('-')[2]}"

    def block(self, language: str, number: int = 0) -> str:
        return re.findall(rf"```{language}\n(.*?)```", self._text, flags=re.DOTALL)[number]

    def lines(self) -> int:
        """Return the lines of the part that are not empty."""
        return sum(bool(line.strip()) for line in self.block("python").splitlines())

    def registry(self, folder: Path, monkeypatch: Any) -> Registry:
        """Return a registry with the part of the page, whose module is written into a folder."""
        (folder / f"{self._module}.py").write_text(self.block("python"), encoding="utf-8")
        (folder / "page.yaml").write_text(self.block("yaml"), encoding="utf-8")
        monkeypatch.syspath_prepend(str(folder))
        sys.modules.pop(self._module, None)
        importlib.invalidate_caches()
        group, name, (_, kind) = self._entry()
        return Registry([*installed_entries(), Entry(group, name, f"{self._module}:{kind}", "newcomer")])

    def check_contract(self, monkeypatch: Any) -> None:
        """Run the suite that the last Python block inherits; the module of the page is in the place that it names."""
        _, _, (place, _) = self._entry()
        monkeypatch.setitem(sys.modules, place, importlib.import_module(self._module))
        names: dict[str, Any] = {}
        exec(self.block("python", -1), names)
        [suite] = [value for key, value in names.items() if key.startswith("Test")]
        tests = [test for test in dir(suite) if test.startswith("test_")]
        assert len(tests) > 5
        for test in tests:
            getattr(suite(), test)()

    def _entry(self) -> tuple[str, str, list[str]]:
        """Return the group, the name, and module and class of the entry point."""
        [(group, entry)] = tomllib.loads(self.block("toml"))["project"]["entry-points"].items()
        [(name, place)] = entry.items()
        return group, name, place.split(":")
