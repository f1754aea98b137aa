"""The end of the tools that generate a page of the documentation."""

import argparse
import sys
from pathlib import Path


def write_or_check(path: Path, text: str, description: str) -> None:
    """Write a page, or with `--check` on the command line only compare it.

    Args:
        description: What the tool does; its first line is in `--help`.
    """
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="only compare")
    if not parser.parse_args().check:
        path.write_text(text)
    elif not path.is_file() or path.read_text() != text:
        sys.exit(f"{path.name} is not up to date: make docs")
