"""Laws of the cheapest path."""

from itertools import product, repeat

import numpy as np
import pytest

from robojackson.geometry.shortest_path import viterbi

STEPS, STATES = 6, 3


@pytest.mark.parametrize("seed", range(20))
def test_no_other_path_is_cheaper(seed: int) -> None:
    """Against all 3^6 paths; small whole numbers as costs give ties."""
    rng = np.random.default_rng(seed)
    draw = rng.normal if seed % 2 else lambda size: rng.integers(0, 4, size).astype(float)
    nodes, edges = draw(size=(STEPS, STATES)), draw(size=(STEPS - 1, STATES, STATES))
    paths = np.array(list(product(range(STATES), repeat=STEPS)))
    step = np.arange(STEPS)
    cost = nodes[step, paths].sum(1) + edges[step[:-1], paths[:, :-1], paths[:, 1:]].sum(1)
    found = viterbi(nodes, edges)
    assert cost[(paths == found).all(1)] == pytest.approx(cost.min())


def test_of_equally_cheap_paths_the_first_states_are_taken() -> None:
    assert np.array_equal(viterbi(np.zeros((4, 3)), np.zeros((3, 3, 3))), np.zeros(4))


def test_edges_lead_from_row_to_column() -> None:
    one_way = np.array([[9.0, 0.0], [9.0, 9.0]])
    assert viterbi(np.zeros((2, 2)), [one_way]).tolist() == [0, 1]


def test_one_step_is_its_cheapest_state() -> None:
    assert viterbi(np.array([[3.0, 1.0, 2.0]]), []).tolist() == [1]


def test_a_path_has_a_step_and_one_change_between_two() -> None:
    with pytest.raises(ValueError, match="at least one step"):
        viterbi(np.empty((0, 2)), [])
    with pytest.raises(ValueError, match="argument 2 is"):
        viterbi(np.zeros((3, 2)), repeat(np.zeros((2, 2)), 3))
