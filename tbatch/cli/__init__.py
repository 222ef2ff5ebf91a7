"""The command line: reads options, calls what does the work, turns errors into messages and exit codes."""

from tbatch.cli import folder_commands
from tbatch.cli.commands import main

__all__ = ["folder_commands", "main"]
