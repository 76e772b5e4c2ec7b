"""``python -m impactlab``: the same as the command ``impactlab``."""

from impactlab.cli import main

if __name__ == "__main__":
    main()
