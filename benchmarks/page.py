"""Pages in headless Chromium: size, time to respond, frames per second.

Frames are those of the animation, by their own counter.

The comparison of the paper's case, and one exact run of a train of four bars (the split Hopkinson bar to start from).

    python -m benchmarks.page [--repeats 5] [--seconds 4]
"""

from __future__ import annotations

import argparse
import statistics
import tempfile
import time
from pathlib import Path

from typer.testing import CliRunner

from impactlab.cli import app
from tests.browser.support import chromium, show

ROOT = Path(__file__).parents[1]
CASES = ROOT / "cases"
TRAIN = ROOT / "impactlab" / "casefile" / "starters" / "hopkinson.yaml"


def written(folder: Path) -> dict[str, Path]:
    """Return the pages by name, written into a folder."""
    commands = {
        "the paper's case, nine methods": ["compare", str(CASES / "axial_impact.yaml")],
        "four bars, exact": ["run", str(TRAIN)],
    }
    pages = {}
    for number, (name, command) in enumerate(commands.items()):
        _run([*command, "--out", str(folder / str(number))])
        pages[name] = folder / str(number) / "index.html"
    return pages


def _run(command: list[str]) -> None:
    result = CliRunner().invoke(app, command)
    if result.exit_code != 0:
        raise SystemExit(result.stderr)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--repeats", type=int, default=5)
    options.add_argument("--seconds", type=float, default=4.0)
    given = options.parse_args()
    with tempfile.TemporaryDirectory() as folder, chromium() as driver:
        for name, page in written(Path(folder)).items():
            ready, drawn = [], []
            for _ in range(given.repeats):
                show(driver, page)
                times = driver.execute_script("return [impactlab.ready, impactlab.drawn]")
                ready.append(times[0])
                drawn.append(times[1])
            driver.execute_script("impactlab.setTime(0); impactlab.play(true)")
            time.sleep(given.seconds)
            rate = driver.execute_script("return impactlab.fps()")
            print(
                f"{name}: {page.stat().st_size / 1000:.0f} kB, responds after {statistics.median(ready):.0f} ms "
                f"(slowest {max(ready):.0f}), all plots drawn after {statistics.median(drawn):.0f} ms, "
                f"{rate:.0f} frames per second"
            )


if __name__ == "__main__":
    main()
