"""The command line: ``exactcreep``, or ``python -m exactcreep``."""

from __future__ import annotations

import os
import sys


def main() -> None:
    """Run the command line of this process."""
    try:
        from exactcreep.cli import main as command_line
    except KeyboardInterrupt:  # before there is anything that hears it
        sys.stderr.write("exactcreep: interrupted\n")
        sys.stderr.flush()
        os._exit(130)
    command_line()


if __name__ == "__main__":
    main()
