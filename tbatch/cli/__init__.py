"""The command line: reads options, calls what does the work, turns errors into messages and exit codes."""

from tbatch.cli import (
    bench_command,
    catalogue_commands,
    folder_commands,
    methods_command,
    result_commands,
    run_commands,
    timeline_commands,
)
from tbatch.cli.app import main

__all__ = [
    "bench_command",
    "catalogue_commands",
    "folder_commands",
    "main",
    "methods_command",
    "result_commands",
    "run_commands",
    "timeline_commands",
]
