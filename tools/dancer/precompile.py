"""Compile the kernels of `warp_robots` for a GPU, on a machine that has none.

    python -m tools.dancer.precompile PACK.npz CACHE [--arch 90]

CACHE is what `WARP_CACHE_PATH` names on the GPU's machine, with `warp.config.cuda_output` "cubin".
A control step is simulated here to see which kernels it launches. Five minutes of a core; a GPU is
then ready after 7 s.
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp
import warp._src.context as context

from tools.dancer.warp_robots import WarpRobots

THREADS = 256
"""Threads of a block where a launch names none."""


class Launches:
    """Modules that are launched, with the threads of their blocks on a GPU."""

    def __init__(self) -> None:
        self.modules: dict[tuple[int, int], Any] = {}
        self._tiled: list[int] = []
        self._plain, self._tiles = context.launch, context.launch_tiled
        context.launch = wp.launch = self._launch
        context.launch_tiled = wp.launch_tiled = self._launch_tiled

    def _launch(self, kernel: Any, *args: Any, **named: Any) -> Any:
        threads = self._tiled[-1] if self._tiled else named.get("block_dim", THREADS)
        self.modules[id(kernel.module), threads] = kernel.module
        return self._plain(kernel, *args, **named)

    def _launch_tiled(self, *args: Any, **named: Any) -> Any:
        self._tiled.append(named.get("block_dim", THREADS))
        try:
            return self._tiles(*args, **named)
        finally:
            self._tiled.pop()


def main() -> None:
    """Compile what is missing in the folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pack", type=Path)
    parser.add_argument("cache", type=Path)
    parser.add_argument("--arch", type=int, default=90, help="90: H100, H200")
    given = parser.parse_args()
    wp.config.kernel_cache_dir, wp.config.cuda_output = str(given.cache.resolve()), "cubin"
    wp.init()
    launches = Launches()
    with np.load(given.pack) as file:
        WarpRobots({name: file[name] for name in file.files}, 8, "cpu").step()
    done = 0
    for (_, threads), module in launches.modules.items():
        module.get_module_hash(threads)
        options = module.resolved_options[threads]
        done += module._compile(None, None, output_arch=given.arch, use_ptx=False, options=options)
    print(f"{done} of {len(launches.modules)} modules compiled for sm_{given.arch}")


if __name__ == "__main__":
    main()
