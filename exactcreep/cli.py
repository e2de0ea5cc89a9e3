"""The command line: one function per command, in `exactcreep.commands`."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Collection, Sequence
from importlib import import_module
from types import ModuleType
from typing import Any

import typer

from exactcreep import __version__, interrupts
from exactcreep.commands import files, studies
from exactcreep.commands.answer import complain
from exactcreep.commands.options import expanded, help_of
from exactcreep.commands.run import resume, run
from exactcreep.gone import successor_of

COMMANDS: dict[str, Callable[..., None]] = {
    "scenes": files.scenes,
    "run": run,
    "resume": resume,
    "reproduce": files.reproduce,
    "sweep": files.sweep,
    "show": files.show,
    "export": files.export,
    "animate": files.animate,
    "explore": files.explore,
    "plan": studies.plan,
    **{name: studies.question(name) for name in studies.QUESTIONS},
    "compare": studies.compare,
}
"""The commands by name."""
_UNUSED = "rich.markdown", "rich.traceback"
"""What typer imports to print a help and does not use for it: a third of the time that it takes."""


def program(wanted: Collection[str]) -> typer.Typer:
    """Return the program with the options of the commands that are wanted; of others the help."""
    app = typer.Typer(
        add_completion=False,
        no_args_is_help=True,
        rich_markup_mode="rich",
        pretty_exceptions_enable=False,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    app.callback()(_exactcreep)
    for name, command in COMMANDS.items():
        called = expanded(command) if name in wanted else _nothing
        app.command(name, help=help_of(command))(called)
    return app


def _nothing() -> None:
    """Stand for a command that is not called."""


def _prepare_help() -> None:
    """Import what prints a help, and stand-ins for what typer imports beside it."""
    spared = {name: ModuleType(name) for name in _UNUSED if name not in sys.modules}
    for module in spared.values():
        vars(module)["__getattr__"] = lambda name: object
    sys.modules.update(spared)
    import_module("typer.rich_utils")
    for name in spared:
        del sys.modules[name]


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"exactcreep {__version__}")
        raise typer.Exit


def _exactcreep(
    version: bool = typer.Option(
        False, "--version", callback=_show_version, is_eager=True, help="Print the version."
    ),
    debug: bool = typer.Option(False, "--debug", help="Show the traceback of an error."),
) -> None:
    """Exact event-driven creep of a chain of sliders with Coulomb friction on an incline.

    Start with [bold]exactcreep scenes[/bold], then [bold]exactcreep run two-sliders-cycles[/bold].

    Not in the model: sliders, springs or contacts that differ, ageing, a temperature that varies
    along the chain, |theta| >= 1, sliders that cross. The book says where to begin to extend it.

    Exit status: 0 any physical outcome, 2 bad input, 3 a limit was reached, 4 the checkpoint is
    older than the result, 130 Ctrl-C, 143 SIGTERM.
    """


def status(words: Sequence[str]) -> int:
    """Run the command that `words` spell and return its exit status."""
    given = list(words)
    end = given.index("--") if "--" in given else len(given)
    debug = "--debug" in given[:end]  # taken anywhere, so that it can be appended to a line
    given = [word for word in given[:end] if word != "--debug"] + given[end:]
    if sentence := successor_of(f"exactcreep {given[0]}" if given else ""):
        complain(sentence)
        return 2
    if not given or {"-h", "--help"} & set(given[:end]):
        _prepare_help()
    usage_error: Any = typer.BadParameter.__mro__[1]
    try:
        returned = program(given)(given, prog_name="exactcreep", standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort):
        complain("interrupted")
        return 130
    except BrokenPipeError:  # the reader, e.g. `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:
        if debug:
            raise
        from exactcreep.model.numbers import InputError

        if isinstance(error, usage_error):
            complain(error.format_message())
        elif isinstance(error, InputError):
            complain(str(error))
        elif os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
            complain("NUMBA_DISABLE_JIT must not be set: the solvers are compiled")
        elif isinstance(error, OSError):
            name = f"{error.filename}: " if error.filename else ""
            complain(f"{name}{error.strerror or error}")
        elif isinstance(error, MemoryError):
            complain("the memory of this machine does not hold so much")
            return 3
        else:
            complain(f"{type(error).__name__}: {error} (a defect; --debug shows where)")
            return 1
        return 2
    return returned if isinstance(returned, int) else 0


def _warn(message: Warning | str, *where: Any, **further: Any) -> None:
    complain(str(message))


def main() -> None:
    """Run the command line of this process."""
    interrupts.listen()
    os.environ["MPLBACKEND"] = "agg"  # whatever it was: pictures are files here
    warnings.showwarning = _warn  # a sentence, without the line of code that says it
    code = status(sys.argv[1:])
    heard = interrupts.status()
    if heard is not None and code in (0, 130):
        if code == 0:  # it came too late to change anything, or was lost on its way
            complain("interrupted")
        code = heard
    sys.exit(code)
