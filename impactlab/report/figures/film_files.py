"""Animations as files, GIF or MP4, in which parts that do not move are drawn once."""

from __future__ import annotations

import logging
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from impactlab.errors import ImpactlabError
from impactlab.history.base import AbstractHistory
from impactlab.report.figures.animation import MOVING, Step, film
from impactlab.report.figures.style import drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RATE = {".gif": 15, ".mp4": 30}  # frames per second of a file
LOG = logging.getLogger("impactlab")
Pixels = NDArray[np.uint8]  # (height, width, 4)


def write(history: AbstractHistory, path: Path, seconds: float = 8.0) -> None:
    """Write the animation of a history into a file, .gif or .mp4.

    Raises
    ------
    ImpactlabError
        As `check_target`; or if ffmpeg fails.
    """
    check_target(path)
    LOG.warning("drawing %s ...", path)
    figure, step, count = film(history)
    shown = np.linspace(0, count - 1, max(2, round(seconds * RATE[path.suffix.lower()]))).round().astype(int)
    writer = write_gif if path.suffix.lower() == ".gif" else write_mp4
    writer(path, pictures(figure, step, np.unique(shown).tolist()), seconds)


@drawn
def pictures(figure: Figure, step: Step, shown: Sequence[int]) -> list[Pixels]:
    """Return frames as pixels, (height, width, 4) each; parts that rest are drawn once."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas: Any = FigureCanvasAgg(figure)
    moving = sorted(figure.findobj(lambda artist: artist.get_gid() == MOVING), key=lambda artist: artist.get_zorder())
    for artist in moving:
        artist.set_animated(True)
    canvas.draw()
    still = canvas.copy_from_bbox(figure.bbox)
    taken = []
    for number in shown:
        step(number)
        canvas.restore_region(still)
        for artist in moving:
            figure.draw_artist(artist)
        taken.append(np.array(canvas.buffer_rgba()))
    for artist in moving:
        artist.set_animated(False)
    return taken


def write_gif(path: Path, taken: Sequence[Pixels], seconds: float) -> None:
    """Write pictures into an endless GIF with the colours of the last one."""
    from PIL import Image

    shown = [Image.fromarray(picture[:, :, :3]) for picture in taken]
    colours = shown[-1].quantize(255, method=Image.Quantize.MEDIANCUT)
    first, *rest = (each.quantize(palette=colours, dither=Image.Dither.NONE) for each in shown)
    first.save(path, save_all=True, append_images=rest, duration=round(1e3 * seconds / len(taken)), loop=0)


def write_mp4(path: Path, taken: Sequence[Pixels], seconds: float) -> None:
    """Write pictures into an MP4 by ffmpeg."""
    height, width, _ = taken[0].shape
    given = f"-y -loglevel error -f rawvideo -pix_fmt rgba -s {width}x{height} -r {len(taken) / seconds:.6g} -i -"
    command = [shutil.which("ffmpeg") or "ffmpeg", *given.split(), "-pix_fmt", "yuv420p", str(path)]
    done = subprocess.run(command, input=b"".join(each.tobytes() for each in taken), capture_output=True, check=False)  # noqa: S603
    if done.returncode != 0:
        raise ImpactlabError(f"ffmpeg could not write '{path}'", remedy=done.stderr.decode(errors="replace")[:300])


def check_target(path: Path) -> None:
    """Raise `ImpactlabError` where no animation can be written: another ending, no folder, no ffmpeg."""
    ending = path.suffix.lower()
    if ending not in RATE:
        raise ImpactlabError(
            f"'{path}' is not a valid file name for an animation", remedy="Give one that ends in .gif or .mp4."
        )
    if not path.absolute().parent.is_dir():
        raise ImpactlabError(f"there is no folder '{path.absolute().parent}'", remedy="Make it, or give another file.")
    if ending == ".mp4" and shutil.which("ffmpeg") is None:
        raise ImpactlabError(
            "an .mp4 needs the program ffmpeg, which is not installed", remedy="Install it, or use .gif."
        )
