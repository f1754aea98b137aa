"""Any BVH (Biovision hierarchy) as a tree of nodes and its motion; units and axes as in the file.

A node's rotation is the product of its rotation channels in the order in which they stand, degrees.
The root stands at its offset plus its position channels; position channels of another node, where
they are not zero throughout, stand for its offset.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice, pairwise

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from robojackson.errors import BadTable
from robojackson.formats.foreign_motion import LARGEST

WHERE = "BVH"
MOST_NODES = 1000
SHORTEST_S = 1e-6
"""Shortest period of a frame."""


@dataclass
class Node:
    """One joint or end site.

    Attributes:
        name: Name of a joint; of an end site that of its joint and `_end`.
        parent: Index of the parent, -1 for the root.
        offset: Offset from the parent, units of the file.
        channels: Names of the channels in the order of the columns.
        first: Column of the first channel.
    """

    name: str
    parent: int
    offset: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    channels: tuple[str, ...] = ()
    first: int = 0

    @property
    def is_end(self) -> bool:
        """Return whether the node is an end site, which has no rotation."""
        return not self.channels


@dataclass(frozen=True)
class Tree:
    """The nodes and frames of a file.

    Attributes:
        nodes: Parents before children.
        frames: One row a frame, one column a channel.
        fps: Frames a second.
    """

    nodes: tuple[Node, ...]
    frames: Float[np.ndarray, "T C"]
    fps: float

    def rotations(self) -> Float[np.ndarray, "T N 3 3"]:
        """Return rotations of all nodes relative to their parents; an end site turns with its
        parent."""
        found = np.tile(np.eye(3), (len(self.frames), len(self.nodes), 1, 1))
        for index, node in enumerate(self.nodes):
            turns = [(c[0], node.first + i) for i, c in enumerate(node.channels) if c[1:] == _TURN]
            if turns:
                axes = "".join(axis for axis, _ in turns)
                angles = self.frames[:, [column for _, column in turns]]
                found[:, index] = Rotation.from_euler(axes, angles, degrees=True).as_matrix()
        return found

    def root(self) -> Float[np.ndarray, "T 3"]:
        """Return the positions of the root, units of the file."""
        node = self.nodes[0]
        place = np.tile(node.offset, (len(self.frames), 1))
        for column, channel in enumerate(node.channels):
            if channel[1:] == _MOVE:
                place[:, "XYZ".index(channel[0])] += self.frames[:, node.first + column]
        return place

    def positions(self) -> Float[np.ndarray, "T N 3"]:
        """Return the positions of all nodes, units of the file."""
        local, place = self.rotations(), np.zeros((len(self.frames), len(self.nodes), 3))
        turned = local.copy()
        place[:, 0] = self.root()
        for index, node in enumerate(self.nodes[1:], start=1):
            turned[:, index] = turned[:, node.parent] @ local[:, index]
            moved = self._moved(node)
            place[:, index] = place[:, node.parent] + (
                turned[:, node.parent] @ node.offset
                if moved is None
                else np.einsum("tij,tj->ti", turned[:, node.parent], moved)
            )
        return place

    def _moved(self, node: Node) -> Float[np.ndarray, "T 3"] | None:
        """Return where a node stands in its parent by its position channels; None without them."""
        columns = [i for i, channel in enumerate(node.channels) if channel[1:] == _MOVE]
        values = self.frames[:, [node.first + i for i in columns]]
        if not values.any():
            return None
        place = np.tile(node.offset, (len(self.frames), 1))
        place[:, ["XYZ".index(node.channels[i][0]) for i in columns]] = values
        return place


_TURN, _MOVE = "rotation", "position"
_CHANNELS = {axis + kind for axis in "XYZ" for kind in (_TURN, _MOVE)}


def parse(data: bytes) -> Tree:
    """Return the tree of a file.

    Raises:
        BadTable: not a BVH, truncated, or numbers that are not finite.
    """
    try:
        words = iter(data.decode("utf-8-sig").split())
        nodes = _hierarchy(words)
        count, period = _head(words)
        width = sum(len(node.channels) for node in nodes)
        table = np.array(list(words), float)
    except UnicodeDecodeError as cause:
        raise BadTable(f"{WHERE}: not text") from cause
    except StopIteration as cause:
        raise BadTable(f"{WHERE}: ends before its motion") from cause
    except (ValueError, IndexError) as cause:
        raise BadTable(f"{WHERE}: damaged ({cause})") from cause
    if width == 0 or count < 2 or table.size < count * width:
        raise BadTable(
            f"{WHERE}: declares {count} frames (at least 2) of {width} channels, "
            f"and has {table.size} numbers"
        )
    offsets = np.array([node.offset for node in nodes])
    if not ((np.abs(table) < LARGEST).all() and (np.abs(offsets) < LARGEST).all()):
        raise BadTable(f"{WHERE}: holds numbers that are not finite, or over {LARGEST:g}")
    if not SHORTEST_S < period < np.inf:
        raise BadTable(f"{WHERE}: 'Frame Time:' is {period:g} seconds")
    frames = table[: count * width].reshape(count, width)
    return Tree(tuple(nodes), frames, round(1.0 / period, 5))


def _hierarchy(words: Iterator[str]) -> list[Node]:
    if next(words, "").upper() != "HIERARCHY":
        raise BadTable(f"{WHERE}: does not begin with HIERARCHY")
    nodes: list[Node] = []
    open_nodes: list[int] = []
    column = 0
    for word in words:
        if word == "MOTION":
            return nodes
        if word in ("ROOT", "JOINT", "End"):
            name, parent = next(words), open_nodes[-1] if open_nodes else -1
            if (parent < 0) != (not nodes) or len(nodes) > MOST_NODES:
                raise BadTable(f"{WHERE}: {name!r}: one root and at most {MOST_NODES} nodes")
            nodes.append(Node(f"{nodes[parent].name}_end" if word == "End" else name, parent))
        elif word == "{":
            open_nodes.append(len(nodes) - 1)
        elif word == "}":
            open_nodes.pop()
        elif word == "OFFSET":
            nodes[open_nodes[-1]].offset = np.array([float(next(words)) for _ in range(3)])
        elif word == "CHANNELS":
            node = nodes[open_nodes[-1]]
            if node.channels:
                raise BadTable(f"{WHERE}: {node.name} has channels twice")
            node.channels = tuple(islice(words, int(next(words))))
            node.first, column = column, column + len(node.channels)
            if not set(node.channels) <= _CHANNELS:
                raise BadTable(f"{WHERE}: {node.name}: unknown channels {node.channels[:9]}")
            turns = [channel[0] for channel in node.channels if channel[1:] == _TURN]
            if len(turns) > 3 or any(a == b for a, b in pairwise(turns)):
                raise BadTable(f"{WHERE}: {node.name}: rotations about {', '.join(turns[:9])}")
        else:
            raise BadTable(f"{WHERE}: unknown word {word[:40]!r} in the hierarchy")
    raise StopIteration


def _head(words: Iterator[str]) -> tuple[int, float]:
    """Return the number of frames and the seconds a frame."""
    entries: dict[str, str] = {}
    for _ in range(2):
        key = next(words)
        if key == "Frame":
            key += " " + next(words)
        entries[key.rstrip(":").lower()] = next(words)
    if set(entries) != {"frames", "frame time"}:
        raise BadTable(f"{WHERE}: the motion has no 'Frames:' and 'Frame Time:'")
    return int(entries["frames"]), float(entries["frame time"])
