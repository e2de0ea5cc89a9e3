"""The command line as ``python -m exactcreep``."""

from __future__ import annotations

from exactcreep.cli import main

if __name__ == "__main__":
    main()
