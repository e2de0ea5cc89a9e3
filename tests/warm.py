"""A warm process for command lines: it has everything imported and compiled, and forks for each.

A forked child begins as a new process does after its imports, with output, folder and variables of
its own. What starts a real process stays with `tests.processes`.
"""

from __future__ import annotations

import contextlib
import json
import os
import shlex
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from exactcreep.__main__ import main
from tests.processes import PATIENCE, environment


class Child:
    """A running command line: signals reach it, and `wait` says how it ended."""

    def __init__(self, channel: socket.socket, out: Any, err: Any) -> None:
        self._channel, self._out, self._err = channel, out, err
        self._lines = channel.makefile()  # the process, then how it ended: they may come together
        self.pid: int = json.loads(self._lines.readline())

    def signal(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):  # it has ended
            os.kill(self.pid, number)

    def wait(self) -> tuple[int, str, str]:
        """Return the exit status (negative: of a signal), and what was printed."""
        self._channel.settimeout(PATIENCE)
        code = os.waitstatus_to_exitcode(json.loads(self._lines.readline()))
        for stream in (self._out, self._err):
            stream.seek(0)
        return code, self._out.read(), self._err.read()


class Warm:
    """The client of a warm process that listens at `address`."""

    def __init__(self, address: Path) -> None:
        self.address = address

    @contextmanager
    def begun(self, line: str, folder: Path, **changed: str) -> Iterator[Child]:
        """Yield a command line that goes on beside the test."""
        asked = {"words": shlex.split(line), "folder": str(folder), "changed": changed}
        with (
            socket.socket(socket.AF_UNIX) as channel,
            tempfile.TemporaryFile("w+") as out,
            tempfile.TemporaryFile("w+") as err,
        ):
            channel.connect(str(self.address))
            message = json.dumps(asked).encode()
            socket.send_fds(channel, [message], [out.fileno(), err.fileno()])
            child = Child(channel, out, err)
            try:
                yield child
            finally:
                child.signal(signal.SIGKILL)

    def run(self, line: str, folder: Path, **changed: str) -> tuple[int, str, str]:
        """Return the exit status of a command line, and what it printed."""
        with self.begun(line, folder, **changed) as child:
            return child.wait()


@contextmanager
def warm_process(folder: Path) -> Iterator[Warm]:
    """Yield a warm process that ends with the test session."""
    address = folder / "warm"
    words = (sys.executable, "-c", "from tests.warm import serve; serve()", str(address))
    with subprocess.Popen(words, env=environment(), stdout=subprocess.PIPE) as server:
        try:
            assert server.stdout is not None
            assert server.stdout.readline() == b"ready\n"
            yield Warm(address)
        finally:
            server.kill()


def serve() -> None:
    """Import and compile what commands need, then fork for every line that is asked for."""
    from exactcreep import cli

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _before_it_began)
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(sys.stderr):
        line = "run two-sliders-cycles --set drive.cycles=2 --set chain.n=3 --plot a.png --out a.nc"
        cli.status([*(word.replace("a.", f"{folder}/a.") for word in line.split()), "--json"])
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for those that answer a client
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(sys.argv[1])
        listening.listen(64)
        print("ready", flush=True)
        while True:
            channel, _ = listening.accept()
            if os.fork() == 0:
                listening.close()
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                _answer(channel)
            channel.close()


def _before_it_began(number: int, frame: object) -> None:
    os._exit(128 + number)


def _answer(channel: socket.socket) -> None:
    """Fork the command line that a client asks for, and tell how it ended."""
    message, streams, _, _ = socket.recv_fds(channel, 2**20, 2)
    if (pid := os.fork()) == 0:
        channel.close()
        _become(json.loads(message), streams)
    channel.send(b"%d\n" % pid)
    channel.send(b"%d\n" % os.waitpid(pid, 0)[1])
    os._exit(0)


def _become(asked: Mapping[str, Any], streams: list[int]) -> None:
    """Run a command line as a process of its own does, and leave with its status."""
    for stream, number in zip((os.open(os.devnull, os.O_RDONLY), *streams), range(3), strict=True):
        os.dup2(stream, number)
    os.chdir(asked["folder"])
    os.environ.update(asked["changed"])
    sys.argv = ["exactcreep", *asked["words"]]
    code = 1
    try:
        main()
    except SystemExit as leaving:
        code = int(leaving.code or 0)
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)
