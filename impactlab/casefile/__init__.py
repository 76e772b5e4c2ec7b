"""The case file room: reads, checks and builds cases. The only room that knows pydantic and YAML."""

from impactlab.casefile.case import Case, load_case

__all__ = ["Case", "load_case"]
