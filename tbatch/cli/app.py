"""The command line's frame: the one ``app``, options that commands share, and errors turned into messages.

Results go to stdout, progress and messages to stderr. No error reaches the user as a traceback; ``exit_codes`` says
which exit code each one gives.
"""

import gc
import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from tbatch import __version__
from tbatch.cli import exit_codes

ORDER = ("run", "resume", "status", "stats", "report", "check", "view", "replay", "methods", "merge", "verify", "bench")


class Commands(TyperGroup):
    """The commands, with every error turned into a message and an exit code."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of the commands, in the order in which they are met."""
        names = super().list_commands(ctx)
        return sorted(names, key=lambda name: ORDER.index(name) if name in ORDER else len(ORDER))

    def invoke(self, ctx: Any) -> Any:
        """Runs a command."""
        try:
            value = super().invoke(ctx)
            sys.stdout.flush()
            return value
        except (Exception, KeyboardInterrupt) as error:
            if type(error).__module__.partition(".")[0] in ("typer", "click") or ctx.params.get("debug"):
                raise  # usage errors and exits, which typer turns into messages and codes itself
            code, text = exit_codes.explain(error)
        if code == exit_codes.BROKEN_PIPE:
            # Whoever read our output has gone; Python would complain again when it flushes stdout at its end.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        elif text:
            say(text)
        raise typer.Exit(code)


app = typer.Typer(cls=Commands, no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode=None)

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A campaign folder.")]
Threads = Annotated[int | None, typer.Option(min=1, help="Threads; default: the cores this process may use.")]
AsJson = Annotated[bool, typer.Option("--json", help="As JSON, in SI units.")]


def main() -> None:
    """Runs the command line; leaves through SystemExit."""
    # Compiling and planning make many objects that stay: looking for garbage among them takes 5 % of a start.
    gc.set_threshold(50_000)
    app(prog_name="tbatch")


def say(text: str) -> None:
    """Says something to the user, beside the results."""
    print(f"tbatch: {text}", file=sys.stderr, flush=True)


def _print_version(asked: bool) -> None:
    if asked:
        print(f"tbatch {__version__}")
        raise typer.Exit


@app.callback()
def options(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and leave.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """How often wheels leave the rail: batched vehicle-track dynamics."""
