"""Settings shared by all tests: properties take the time they need, and print how to repeat a failure."""

from __future__ import annotations

import os

from hypothesis import HealthCheck, settings

# Where a change is judged (CI is set), the same examples every time; elsewhere new ones at each run.
settings.register_profile(
    "impactlab",
    deadline=None,
    print_blob=True,
    derandomize=bool(os.environ.get("CI")),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("impactlab")
