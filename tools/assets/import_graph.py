"""The import graph of the packages, drawn from the code (pictures of docs/architecture.md).

    python -m tools.assets.import_graph -o docs/images/imports_after.png
    git worktree add OLD COMMIT && python -m tools.assets.import_graph --root OLD -o before.png

A matrix: a row a package that imports, a column one that is imported, in the order in
which they may. A cell is the number of modules that import from there; right of the diagonal it
points up and is red. An `m` marks an arrow that is hidden in a child process (`python -m MODULE`).
Imports inside functions count. The circles between modules are listed on stdout.
"""

import argparse
import ast
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import networkx as nx
import numpy as np

TOPS = ("robojackson", "storage", "configs", "tasks", "flows")
LIBRARY = (
    *(
        "errors",
        "config",
        "geometry",
        "files",
        "motion",
        "body",
        "robot",
        "metrics",
        "formats",
        "clips",
        "mocap",
    ),
    *("retarget", "rl", "report", "pipeline", "api", "cli"),
)
"""The order inside the library; packages that a tree does not have are left out."""
ROOT_OF_COMPOSITION = "robojackson.__main__"
Edges = Mapping[str, frozenset[str]]


def modules_of(root: Path) -> dict[str, Path]:
    """Return the files of all modules by dotted name; a package has the name of its folder."""
    found = {}
    for top in TOPS:
        for path in sorted((root / top).rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports_of(modules: Mapping[str, Path]) -> Edges:
    """Return the modules of ours that each module imports."""
    return {name: frozenset(_imported(path, modules)) for name, path in modules.items()}


def hidden_arrows(modules: Mapping[str, Path]) -> Edges:
    """Return the modules that each module names in a text, as for `python -m`."""
    return {name: frozenset(_named(path) & modules.keys()) for name, path in modules.items()}


def circles(edges: Edges) -> list[list[str]]:
    """Return the groups of modules that import one another."""
    graph = nx.DiGraph([(name, other) for name, others in edges.items() for other in others])
    return sorted(
        sorted(group) for group in nx.strongly_connected_components(graph) if len(group) > 1
    )


def package_of(module: str) -> str:
    """Return the row of a module: its package in the library, or its layer."""
    parts = module.split(".")
    return parts[1] if parts[0] == "robojackson" and len(parts) > 1 else parts[0]


def order_of(modules: Mapping[str, Path]) -> list[str]:
    """Return the packages that a tree has, in the order in which they may import."""
    there = {package_of(module) for module in modules}
    return [name for name in (*LIBRARY, *TOPS[1:]) if name in there]


def counts(edges: Edges, order: Sequence[str]) -> Counter[tuple[str, str]]:
    """Return how many modules of a package import from another package."""
    found: Counter[tuple[str, str]] = Counter()
    for name, others in edges.items():
        if name != ROOT_OF_COMPOSITION:
            found.update({(package_of(name), package_of(other)) for other in others})
    return Counter({k: n for k, n in found.items() if k[0] != k[1] and {*k} <= {*order}})


def draw(edges: Edges, hidden: Edges, order: Sequence[str], title: str, out: Path) -> None:
    """Write the matrix as a picture."""
    size = len(order)
    place = {name: index for index, name in enumerate(order)}
    figure, axes = plt.subplots(figsize=(0.42 * size + 2.0, 0.42 * size + 1.6))
    colours = np.ones((size, size, 3))
    for (row, column), number in counts(edges, order).items():
        _fill(axes, colours, place[row], place[column], str(number))
    for row, column in counts(hidden, order):
        if place[column] > place[row]:
            _fill(axes, colours, place[row], place[column], "m")
    colours[range(size), range(size)] = 0.85
    axes.imshow(colours, interpolation="nearest")
    axes.set_xticks(range(size), order, rotation=60, ha="left", rotation_mode="anchor")
    axes.set_yticks(range(size), order)
    axes.tick_params(top=True, labeltop=True, bottom=False, labelbottom=False, length=0)
    axes.set_xlabel(title)
    for edge in np.arange(size + 1) - 0.5:
        axes.axhline(edge, color="0.8", lw=0.5)
        axes.axvline(edge, color="0.8", lw=0.5)
    figure.savefig(out, dpi=110, bbox_inches="tight")
    plt.close(figure)


def _fill(axes: plt.Axes, colours: np.ndarray, row: int, column: int, text: str) -> None:
    up = column > row
    colours[row, column] = (0.93, 0.36, 0.31) if up else (0.78, 0.88, 0.96)
    axes.text(column, row, text, ha="center", va="center", fontsize=8)


def _imported(path: Path, modules: Mapping[str, Path]) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                if found := next((n for n in (name, node.module) if n in modules), None):
                    yield found


def _named(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    constants = (node.value for node in ast.walk(tree) if isinstance(node, ast.Constant))
    return {value for value in constants if isinstance(value, str) and "." in value}


def main() -> None:
    """Draw one tree."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=Path, default=Path.cwd())
    parser.add_argument("--title", default="")
    parser.add_argument("-o", "--out", type=Path, required=True)
    given = parser.parse_args()
    modules = modules_of(given.root)
    edges = imports_of(modules)
    order = order_of(modules)
    title = given.title or f"{len(modules)} modules; a cell: modules of the row that import there"
    draw(edges, hidden_arrows(modules), order, title, given.out)
    up = [k for k in counts(edges, order) if order.index(k[1]) > order.index(k[0])]
    print(f"{given.out}: {len(modules)} modules, arrows up: {sorted(up)}")
    for group in circles(edges):
        print(f"circle: {', '.join(group)}")


if __name__ == "__main__":
    main()
