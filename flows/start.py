"""Where the command starts: nothing heavy is imported before Ctrl-C gets its one line."""

import sys

INTERRUPTED = 130


def main() -> None:
    """Entry point of the console script; ends the process."""
    try:
        from flows.cli import main as command

        code = command()
    except KeyboardInterrupt:
        sys.stderr.write("robojackson: interrupted\n")
        code = INTERRUPTED
    sys.exit(code)
