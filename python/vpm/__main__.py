"""``python -m vpm``."""

from vpm.cli import main

if __name__ == "__main__":
    main()
