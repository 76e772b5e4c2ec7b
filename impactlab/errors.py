"""The error family of impactlab: every failure says where, what was given, what is allowed, what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from impactlab.history import AbstractHistory


class ImpactlabError(Exception):
    """Something a user can mend; carries the place of the fault.

    Parameters
    ----------
    text : str
        What is wrong: what was given and what is allowed.
    remedy : str
        What to do about it; may be empty.
    path : str
        Dotted path in the case, e.g. ``contacts.0.law.kind``; empty where none applies.
    file : str
        Name of the case file; filled in by the case file room.
    line : int or None
        Line in that file, from 1.
    """

    def __init__(self, text: str, *, remedy: str = "", path: str = "", file: str = "", line: int | None = None) -> None:
        super().__init__(text)
        self.text = text
        self.remedy = remedy
        self.path = path
        self.file = file
        self.line = line

    def located(self, file: str, line: int | None) -> ImpactlabError:
        """Return the same error with the file and line filled in (in place; kept if already known)."""
        if not self.file:
            self.file = file
            self.line = line
        return self

    def __str__(self) -> str:
        place = ""
        if self.file:
            place = f"{self.file}:{self.line}: " if self.line is not None else f"{self.file}: "
        where = f"{self.path}: " if self.path else ""
        remedy = f"\n{self.remedy}" if self.remedy else ""
        return f"{place}{where}{self.text}{remedy}"


class CaseError(ImpactlabError):
    """The case is wrong: a key, a value, a unit, or physics that cannot be."""


class PairingError(ImpactlabError):
    """Two parts that cannot work together were paired."""


class PluginError(ImpactlabError):
    """A part is not installed, is broken, or two parts have one name."""


class StepError(ImpactlabError):
    """A run failed on the way; what was reached is kept.

    Parameters
    ----------
    time : float
        Time reached [s].
    step : int
        Number of the step that failed, from 0.
    history : AbstractHistory or None
        What was reached before the failure.
    """

    def __init__(
        self,
        text: str,
        *,
        time: float,
        step: int,
        history: AbstractHistory | None = None,
        remedy: str = "",
        path: str = "",
    ) -> None:
        super().__init__(f"{text} (t = {time:.6g} s, step {step})", remedy=remedy, path=path)
        self.time = time
        self.step = step
        self.history = history
