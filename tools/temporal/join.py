"""Join trained networks into one weights file, whose answer is the mean of theirs.

    python -m tools.temporal.join FIRST.safetensors OTHERS.safetensors... -o temporal.safetensors

The flow is that of the first.
"""

import argparse
import sys
from pathlib import Path

import torch
from safetensors.torch import load_file, save_file

from robojackson.mocap.temporal.temporal_network import ALSO


def joined(files: list[Path]) -> dict[str, torch.Tensor]:
    """Return the arrays of weights files as one."""
    first, *others = (load_file(path) for path in files)
    for number, arrays in enumerate(others, 1):
        first |= {
            f"{ALSO}{number}.{name}": value
            for name, value in arrays.items()
            if not name.startswith("flow.")
        }
    return first


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("weights", type=Path, nargs="+")
    parser.add_argument("-o", "--out", type=Path, required=True)
    options = parser.parse_args(arguments)
    save_file(joined(options.weights), options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
