"""The whole corpus: bad inputs over every entry point, and odd ones that are valid."""

from tests.badinput import (
    configurations,
    environments,
    motion_files,
    networks,
    robot_files,
    stores,
    tables,
    valid_inputs,
    videos,
    words,
)
from tests.badinput.case import Case

KINDS = (
    *(videos, tables, motion_files, networks, robot_files, configurations, environments),
    *(stores, words, valid_inputs),
)


def corpus() -> list[Case]:
    """Return all cases; no two have the same group and name."""
    found = [case for kind in KINDS for case in kind.cases()]
    keys = {(case.group, case.name) for case in found}
    assert len(keys) == len(found), "two cases of one name"
    return found
