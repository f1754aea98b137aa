"""Record work on a GPU once and replay it without the cost of its launches (CUDA graphs)."""

from collections.abc import Callable

import torch

WARM_UPS = 3


def recorded(
    work: Callable[[], None], device: torch.device, random: torch.Generator | None = None
) -> Callable[[], None]:
    """Return a function that does the same on the same tensors; on a processor the function itself.

    What the work reads and writes must stay in place: it writes with `copy_`.

    Args:
        work: Is called a few times.
        random: Generator that the work draws from, beside the device's own.
    """
    if device.type != "cuda":
        return work
    stream = torch.cuda.Stream()
    stream.wait_stream(torch.cuda.current_stream())
    with torch.cuda.stream(stream), torch.no_grad():
        for _ in range(WARM_UPS):
            work()
    torch.cuda.current_stream().wait_stream(stream)
    torch.cuda.synchronize()
    graph = torch.cuda.CUDAGraph()
    if random is not None:
        graph.register_generator_state(random)
    with torch.cuda.graph(graph), torch.no_grad():
        work()
    replay: Callable[[], None] = graph.replay
    return replay
