r"""Join trained networks into one weights file, whose answer is the weighted mean of theirs.

    python -m tools.temporal.join FIRST.safetensors OTHERS.safetensors... -o temporal.safetensors \
        --shares 2 1

The flow is that of the first.
"""

import argparse
import sys
from pathlib import Path

import torch
from safetensors.torch import load_file, save_file

from robojackson.errors import BadWeights
from robojackson.mocap.temporal.temporal_network import ALSO, SHARE


def joined(files: list[Path], shares: list[float]) -> dict[str, torch.Tensor]:
    """Return the arrays of weights files as one.

    Raises:
        BadWeights: a file holds several networks already.
    """
    first, *others = (
        load_file(path) | {SHARE: torch.tensor(share)}
        for path, share in zip(files, shares, strict=True)
    )
    for path, arrays in zip(files, (first, *others), strict=True):
        if any(name.startswith(ALSO) for name in arrays):
            raise BadWeights(
                f"{path}: holds several networks already: join those that it was made of"
            )
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
    parser.add_argument("--shares", type=float, nargs="+", help="default: equal ones")
    options = parser.parse_args(arguments)
    shares = options.shares or [1.0] * len(options.weights)
    if len(shares) != len(options.weights):
        parser.error(f"{len(options.weights)} files need as many shares, not {len(shares)}")
    save_file(joined(options.weights, shares), options.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
