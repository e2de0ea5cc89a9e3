"""The command line: one function per command, in `exactcreep.commands`."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any

import typer

from exactcreep import __version__, interrupts
from exactcreep.commands.animate import animate
from exactcreep.commands.answer import complain
from exactcreep.commands.audit import audit
from exactcreep.commands.compare import compare
from exactcreep.commands.envelope import envelope
from exactcreep.commands.explore import explore
from exactcreep.commands.export import export
from exactcreep.commands.fate import fate
from exactcreep.commands.plan import plan
from exactcreep.commands.reproduce import reproduce
from exactcreep.commands.run import resume, run
from exactcreep.commands.scenes import scenes
from exactcreep.commands.show import show
from exactcreep.commands.survival import survival
from exactcreep.commands.sweep import sweep
from exactcreep.commands.threshold import threshold
from exactcreep.commands.tradeoff import tradeoff

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for _command in (scenes, run, resume, reproduce, sweep, show, export, animate, explore, plan,
                 tradeoff, threshold, fate, survival, compare, audit, envelope):  # fmt: skip
    app.command()(_command)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"exactcreep {__version__}")
        raise typer.Exit


@app.callback()
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
    usage_error: Any = typer.BadParameter.__mro__[1]
    try:
        returned = app(given, prog_name="exactcreep", standalone_mode=False)
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
    warnings.showwarning = _warn  # a sentence, without the line of code that says it
    code = status(sys.argv[1:])
    heard = interrupts.status()
    if heard is not None and code in (0, 130):
        if code == 0:  # it came too late to change anything, or was lost on its way
            complain("interrupted")
        code = heard
    sys.exit(code)
