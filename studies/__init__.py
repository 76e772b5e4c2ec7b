"""Programs that measure and write the pages of docs/: ``python -m studies``."""
