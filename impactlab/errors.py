"""The errors of impactlab, with the place, the given value and the remedy."""

from __future__ import annotations

import contextlib
import errno
import numbers
import traceback
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # of an output whose disk is full
MIN_BEGINNING = 3  # letters of a name that may be the beginning of another one
MIN_LIKENESS = 0.65  # of difflib: with 0.6 'acceleration' is taken for 'rotation'
MAX_COMPARED = 80  # characters of a name whose nearest ones are looked for
MAX_SEED = 2**32 - 1
NUMBER, WHOLE = "a number", "a whole number"  # values that a place may need
MAX_OTHERS = 3  # further faults of a file that a message shows


class ImpactlabError(Exception):
    """A fault that a user can fix; carries its place.

    Parameters
    ----------
    text : str
        The fault: the given value and the allowed ones.
    remedy : str
        How to fix it; may be empty.
    path : str
        Dotted path in the case, e.g. ``contacts.0.law.kind``; empty where none applies.
    file : str
        Name of the case file; filled in by `impactlab.casefile`.
    line : int or None
        Line in that file, from 1.
    needs : str
        `NUMBER` or `WHOLE` of a place that takes only those, where another value was given.
    """

    def __init__(
        self, text: str, *, remedy: str = "", path: str = "", file: str = "", line: int | None = None, needs: str = ""
    ) -> None:
        super().__init__(text)
        self.text = text
        self.remedy = remedy
        self.path = path
        self.file = file
        self.line = line
        self.given_by = ""  # the option or function that gave the value, where it does not stand in the file
        self.needs = needs
        self.led_back = False  # whether the path names a block as it stands in the file, not one made from it
        self.others: tuple[ImpactlabError, ...] = ()  # faults of the same file that were found with this one

    def located(self, file: str, line: int | None) -> ImpactlabError:
        """Fill in file and line where they are not known, and return the error."""
        if not self.file:
            self.file = file
            self.line = line
        return self

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._fault()!r})"

    def __str__(self) -> str:
        remedies = (self.remedy.strip(), *(f"Also {each.in_a_line()}" for each in self.others[:MAX_OTHERS]))
        if (left := len(self.others) - MAX_OTHERS) > 0:
            remedies += (f"... and {left} more fault{'s' if left > 1 else ''}: `impactlab check FILE` lists all.",)
        return "\n".join((self._fault(), *filter(None, remedies)))

    def in_a_line(self) -> str:
        """Return place, fault and remedy, without the faults that were found with this one."""
        fault, remedy = self._fault(), self.remedy.strip()
        ended = fault if fault.endswith((".", "?")) or not remedy else f"{fault}."
        return f"{ended} {remedy}".strip()

    def _fault(self) -> str:
        place = ""
        if self.file:
            line = f":{self.line}" if self.line is not None else ""
            place = f"{self.file}{line}{f', given by {self.given_by}' if self.given_by else ''}: "
        elif self.given_by.startswith("--"):
            place = f"{self.given_by} "
        where = f"{self.path}: " if self.path else ""
        return f"{place}{where}{self.text}"


OTHER_WORDS = {
    "absorbing": "infinite",
    "ball": "mass",
    "bar": "rod",
    "deflection": "displacement",
    "encastre": "clamped",
    "explicit": "central_difference",
    "fem": "finite_element",
    "fixed": "clamped",
    "floor": "wall",
    "ground": "wall",
    "hard": "addition_deletion",
    "implicit": "newmark",
    "kelvin_voigt": "penalty",
    "leapfrog": "central_difference",
    "linear": "penalty",
    "moment": "bending_moment torque",
    "non_reflecting": "infinite",
    "particle": "mass",
    "point_mass": "mass",
    "rigid": "mass addition_deletion clamped",
    "rigid_body": "mass",
    "shear": "shear_force",
    "sigma": "stress",
    "simply_supported": "pinned",
    "slope": "rotation",
    "speed": "velocity",
    "sphere": "mass",
    "spring": "penalty",
    "velocity_verlet": "central_difference",
    "verlet": "central_difference",
}
"""Words of other programs and of textbooks for kinds of bodies, ends, parts and quantities: those of a case."""


def closest(name: str, names: Iterable[str]) -> str:
    """Return `` Did you mean 'x'?`` with the name nearest to a word, or nothing.

    Words for the same thing (`OTHER_WORDS`), beginnings and the other order of a pair of bodies count as near.
    """
    name = str(name)
    known, word = list(names), name[:MAX_COMPARED].strip().lower()
    head, colon, pair = name.partition(":")
    turned = f"{head}{colon}{'|'.join(reversed(pair.split('|')))}"  # a contact b|a, where a|b is known
    close = [other for other in known if other.lower() == word or (other == turned and "|" in pair)]
    if not close:
        meant = OTHER_WORDS.get(word.replace(" ", "_").replace("-", "_"), "").split()
        close = [other for other in meant if other in known]
    close = close or get_close_matches(name[:MAX_COMPARED], known, n=1, cutoff=MIN_LIKENESS)
    if not close and len(word) >= MIN_BEGINNING:
        close = [other for other in known if other.startswith(word)]
    return f" Did you mean {close[0]!r}?" if close else ""


def unreadable(path: Path, error: Exception) -> str:
    """Return the reason why a file cannot be read.

    Of a missing file it includes the nearest name in the same folder.
    """
    if not isinstance(error, FileNotFoundError):
        return str(getattr(error, "strerror", None) or error)
    others: list[str] = []
    with contextlib.suppress(OSError):  # a folder that is missing, or cannot be listed
        others += [other.name for other in path.parent.iterdir()]
    return f"the file does not exist.{closest(path.name, others)}"


class ExtraError(ImpactlabError, ImportError):  # type: ignore[misc] # both have a path
    """A library of an extra is missing; the remedy is the command that installs it."""


def combined(errors: Sequence[ImpactlabError]) -> ImpactlabError:
    """Return the first of several faults of one file, which holds the others, each once."""
    found: dict[tuple[str, str], ImpactlabError] = {}
    for error in errors:
        for each in (error, *error.others):
            found.setdefault((each.path, each.text), each)
    first, *others = found.values()
    for each in others:
        each.others = ()
    first.others = tuple(others)
    return first


def raised_at(error: BaseException) -> str:
    """Return an exception of a part in words: class, text, file and line."""
    place = traceback.extract_tb(error.__traceback__)[-1:]
    return f"{type(error).__name__}: {error}" + "".join(f" ({each.filename}, line {each.lineno})" for each in place)


class CaseError(ImpactlabError):
    """The case is wrong: a key, a value, a unit, or impossible physics."""


def expect_whole(given: object, name: str, least: int, most: int) -> None:
    """Raise `CaseError` unless an argument is a whole number from ``least`` to ``most``.

    The error calls the argument by its ``name``.
    """
    if isinstance(given, bool) or not isinstance(given, numbers.Integral) or not least <= int(given) <= most:
        remedy = f"Give a whole number from {least} to {most}."
        raise CaseError(f"{str(given)[:MAX_COMPARED]} is not allowed", remedy=remedy, path=name)


def expect_path(given: object, function: str, remedy: str = "Give a text or a Path.") -> None:
    """Raise `CaseError` where a function was not given the path of a file or folder, or one that cannot be."""
    if not isinstance(given, (str, Path)):
        raise CaseError(f"{function}() takes the path of a file, not a {type(given).__name__}", remedy=remedy)
    try:
        Path(given).stat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        pass  # a file to be written, or an error of the next call
    except (OSError, ValueError):  # too long, or of characters that no name may have
        raise CaseError(f"{str(given)[:MAX_COMPARED]!a} cannot be a path", remedy="Give another name.") from None


def texts(name: str, given: object, remedy: str) -> list[str]:
    """Return several texts, of which an argument consists, as a list.

    Raise `CaseError` for anything else; the error calls the argument by its ``name``.
    """
    several = isinstance(given, Iterable) and not isinstance(given, (str, bytes))
    found = []
    for each in [*given] if several else [given]:  # type: ignore[misc]
        if not isinstance(each, str):
            text = f"{str(each)[:MAX_COMPARED]} is a {type(each).__name__}, not a text"
            raise CaseError(text, remedy=remedy, path=name)
        found.append(each)
    return found


class PairingError(ImpactlabError):
    """Two parts that cannot work together were paired."""


class PluginError(ImpactlabError):
    """A part is not installed, is broken, or two parts have one name."""


class RunWarning(UserWarning):
    """A warning of a finished run, of one of the classes below."""


class DoubtfulResult(RunWarning):
    """A doubtful result: tolerance missed, linear theory left, energy gained or lost."""


class UnusualValue(RunWarning):
    """A value of the case looks like a mistake, such as a wrong wave speed."""


class RunNote(RunWarning):
    """Any other warning of a run; shown only under a filter that admits it."""


class SweepError(ImpactlabError):
    """A sweep that ended before all of its points were computed.

    Finished points are kept in its folder.
    """


class StepError(ImpactlabError):
    """A run failed on the way; its history so far is kept.

    Parameters
    ----------
    time : float
        Time reached [s].
    step : int
        Number of the step that failed, from 0.
    history : AbstractHistory or None
        The history up to the failure (`impactlab.history.base`).
    """

    def __init__(
        self, text: str, *, time: float, step: int, history: Any = None, remedy: str = "", path: str = ""
    ) -> None:
        super().__init__(f"{text} (t = {time:.6g} s, step {step})", remedy=remedy, path=path)
        self.time = time
        self.step = step
        self.history = history
