"""The cheapest path through states that follow one another in time, by dynamic programming.

    min over s of  sum_t node_cost[t, s_t] + sum_t edge_cost[t][s_t, s_t+1]        (Viterbi 1967)

With negative log likelihoods as costs it is the likeliest path of a hidden Markov model.
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float, Int


def viterbi(
    node_cost: Float[np.ndarray, "T S"], edge_costs: Iterable[Float[np.ndarray, "S S"]]
) -> Int[np.ndarray, " T"]:
    """Return the state of each step on the cheapest path; of equally cheap states the first.

    Args:
        node_cost: Cost of each state at each step, any unit.
        edge_costs: Costs of each of the T - 1 changes, in the same unit, from row to column.
    Raises:
        ValueError: there is no step, or the number of changes is not T - 1.
    """
    if not len(node_cost):
        raise ValueError("a path needs at least one step")
    best = node_cost[0]
    origins = []
    for edge_cost, cost in zip(edge_costs, node_cost[1:], strict=True):
        total = best[:, None] + edge_cost
        origin = total.argmin(axis=0)
        best = total[origin, np.arange(len(best))] + cost
        origins.append(origin)
    path = np.empty(len(node_cost), int)
    path[-1] = best.argmin()
    for step in range(len(origins), 0, -1):
        path[step - 1] = origins[step - 1][path[step]]
    return path
