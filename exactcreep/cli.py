"""The command line: one function per command, in `exactcreep.commands`."""

from __future__ import annotations

import codecs
import io
import os
import sys
import warnings
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any

from cyclopts import (
    App,
    CycloptsError,
    Group,
    MissingArgumentError,
    Parameter,
    UnknownOptionError,
    UnusedCliTokensError,
)

from exactcreep import __version__, moved
from exactcreep.commands import files, studies
from exactcreep.commands.answer import complain, unread
from exactcreep.commands.record import record, roof
from exactcreep.commands.run import run
from exactcreep.commands.values import help_of
from exactcreep.watch import interrupts, preparation, terminal

COMMANDS: dict[str, Callable[..., None] | None] = {
    "scenes": files.scenes,
    "run": run,
    "show": files.show,
    "animate": files.animate,
    "explore": files.explore,
    "record": record,
    "roof": roof,
    **dict.fromkeys(studies.QUESTIONS),
    "compare": studies.compare,
}
"""The commands by name; None: made from a public function, which is imported when called."""
_PLAIN = {"±": "+-", "…": "...", "–": "-", "×": "x"}
"""Replacements for signs that a stream cannot encode."""
_warned: set[str] = set()
_HELP = """Exact event-driven creep of a chain of sliders with Coulomb friction on an incline.

Start with exactcreep scenes, then exactcreep run two-sliders-cycles.

Friction, forces at the ends, thermal expansion and temperature may differ along the chain. Not in \
the model: masses and stiffnesses that differ, ageing, |theta| >= 1, sliders that cross. The book \
says where to begin to extend it.

Exit status: 0 any physical outcome, 2 bad input, 3 a limit was reached, 4 the checkpoint is older \
than the result, 130 Ctrl-C, 143 SIGTERM. With --debug, anywhere in the line, an error shows its \
traceback."""


def program(wanted: Collection[str]) -> App:
    """Return the program; it imports only the `wanted` public functions, and lists the others."""
    app = App(
        name="exactcreep",
        help=_HELP,
        help_format="plaintext",
        version=f"exactcreep {__version__}",
        group_parameters=Group("Options"),
        suppress_keyboard_interrupt=False,
        console=terminal.console(),
        default_parameter=Parameter(
            allow_repeating=True, negative_iterable=(), negative_none=(), show_choices=False
        ),
    )
    for place, (name, function) in enumerate(COMMANDS.items()):
        if function is None and name not in wanted:
            function, said = _not_called, studies.QUESTIONS[name].summary
        else:
            function = function or studies.question(name)
            said = help_of(function)
        app.command(function, name=name, help=said, sort_key=place)
    return app


def _not_called() -> None:
    """Stand for a public function that is not imported."""


def status(words: Sequence[str]) -> int:
    """Run the command line `words` and return its exit status."""
    arguments = list(words)
    end = arguments.index("--") if "--" in arguments else len(arguments)
    debug = "--debug" in arguments[:end]  # anywhere, so that it can be appended to a line
    arguments = [word for word in arguments[:end] if word != "--debug"] + arguments[end:]
    code = 0 if arguments else 2
    try:
        try:
            if arguments and arguments[0] not in COMMANDS and not arguments[0].startswith("-"):
                complain(_no_command(arguments[0]))
                return 2
            with preparation.command():
                program(arguments[:1])(
                    arguments, exit_on_error=False, print_error=False, result_action="return_value"
                )
        except SystemExit as leaving:
            # if a pager closes the pipe of a help, click exits with 1
            gone = isinstance(leaving.__context__, BrokenPipeError)
            code = 0 if gone else int(leaving.code or 0)
        with unread():
            terminal.stream().flush()
    except Exception as error:
        interrupts.check()  # an interrupted call may end with any error
        if debug:
            raise
        code, said = _failed(arguments, error)
        complain(said)
    return code


def _no_command(name: str) -> str:
    """Return the sentence about an unknown command: where it went, or a similar line."""
    from exactcreep.model.names import did_you_mean

    if name in moved.COMMANDS:
        return f"No such command {name!r}: {moved.COMMANDS[name]}"
    # not by exactcreep.scene, which loads numpy
    scenes = [f"run {path.stem}" for path in (Path(__file__).parent / "scenes").glob("*.toml")]
    near = did_you_mean(name, [*COMMANDS, "--help"]) or did_you_mean(f"run {name}", scenes)
    return f"No such command {name!r}{near or '; exactcreep --help lists the commands'}"


def _failed(arguments: Sequence[str], error: Exception) -> tuple[int, str]:
    """Return the exit status of a command line that failed, and the sentence about it."""
    from exactcreep.model.numbers import InputError

    match error:
        case preparation.Late() | Exception(__cause__=preparation.Late()):
            return 3, str(error if isinstance(error, preparation.Late) else error.__cause__)
        case UnusedCliTokensError():
            told = "; --set takes KEY=VALUE" if "--set" in arguments else ""
            further = " ".join(error.unused_tokens or ())
            return 2, f"{arguments[0]} takes no further {further!r}{told}"
        case MissingArgumentError():
            return 2, _missing(arguments, error)
        case UnknownOptionError():
            return 2, _no_option(arguments, error)
        case _ if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
            return 2, "NUMBA_DISABLE_JIT must not be set: the solvers are compiled"
        case CycloptsError() | InputError():
            return 2, str(error)
        case OSError():
            name = f"{error.filename}: " if error.filename else ""
            return 2, f"{name}{error.strerror or error}"
        case MemoryError():
            return 3, "the memory of this machine does not hold so much"
    return 1, f"{type(error).__name__}: {error} (a defect; --debug shows where)"


def _missing(arguments: Sequence[str], error: MissingArgumentError) -> str:
    """Return the sentence about what a command line lacks, with a line that has it."""
    name = error.argument.name if error.argument else ""
    if name in arguments:
        return f"{name} needs a value"
    function = COMMANDS[arguments[0]] or studies.question(arguments[0])
    _, _, examples = (function.__doc__ or "").partition("Examples")
    line = next(line for line in examples.splitlines() if "exactcreep" in line)
    return f"{arguments[0]} needs {name}, e.g. {line.strip()}"


def _no_option(arguments: Sequence[str], error: UnknownOptionError) -> str:
    """Return the sentence about an unknown option: it suggests a similar option, or --set."""
    from exactcreep.model.names import did_you_mean
    from exactcreep.scene import key_of

    command, token = arguments[0], error.token.keyword or error.token.value
    option = token.partition("=")[0]
    options = [name for each in error.argument_collection if each.parse for name in each.names]
    words = [part for word in arguments for part in word.split("=")]
    value = [*words[1 + words.index(option) :], "..."][0]
    key = key_of(option.lstrip("-").replace("-", "_")) if "--set" in options else ""
    if key:
        setting = f"vary.{key}=[{value}]" if "," in value else f"{key}={value}"
        return f"{command} takes a scene; set its {key} with --set {setting}"
    if option in moved.OPTIONS:
        return f"{command} has no option {option}: {moved.OPTIONS[option]}"
    return f"{command} has no option {option}{did_you_mean(option, options)}"


def _warn(message: Warning | str, *where: Any, **further: Any) -> None:
    about = str(message).partition(" = ")[0]  # warn only once of many slopes
    if about not in _warned:
        _warned.add(about)
        complain(str(message))


def _plain(error: Any) -> tuple[str, int]:
    """Replace a sign that a stream cannot encode; an error handler of `codecs`."""
    sign = error.object[error.start]
    return _PLAIN.get(sign) or ascii(sign)[1:-1], error.start + 1


def main() -> None:
    """Run the command line of this process."""
    interrupts.listen()
    try:
        codecs.register_error("plain", _plain)
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="plain")
        os.environ["MPLBACKEND"] = "agg"  # pictures are always files here
        warnings.showwarning = _warn  # a sentence, without a line of code
        code = status(sys.argv[1:])
    except KeyboardInterrupt:
        complain("interrupted")
        code = 130
    heard = interrupts.status()
    if heard is not None and code in (0, 130):
        if code == 0:  # the signal came after the last check
            complain("interrupted")
        code = heard
    interrupts.leave(code)
