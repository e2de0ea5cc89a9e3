"""The command line: ``exactcreep``, or ``python -m exactcreep``."""

from __future__ import annotations

import os
import signal

_UNSAID = (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning)


def main() -> None:
    """Run the command line of this process."""
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _leave)  # until there is a result to save
    import warnings

    warnings.resetwarnings()  # PYTHONWARNINGS must not turn a warning into an error
    for kind in _UNSAID:
        warnings.simplefilter("ignore", kind)
    from exactcreep.cli import main as command_line

    command_line()


def _leave(number: int, frame: object) -> None:
    os.write(2, b"exactcreep: interrupted\n")
    os._exit(128 + number)


if __name__ == "__main__":
    main()
