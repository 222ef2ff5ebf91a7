"""The command line: reads options, calls what does the work, turns errors into messages and exit codes."""

from tbatch.cli.commands import main

__all__ = ["main"]
