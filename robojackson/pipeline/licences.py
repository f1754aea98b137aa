"""The licences of everything that runs or ships with RoboJackson: packages by their metadata, data
by our list; and the same as a bill of materials (SBOM, CycloneDX 1.5)."""

import json
import re
import uuid
from collections.abc import Iterator
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

from robojackson.files.file_tree import FileTree
from robojackson.files.foreign_file import parse_json

OURS = "robojackson"
DATA = Path(__file__).parent.parent / "assets" / "data_licences.json"
NAME = re.compile(r"[A-Za-z0-9._-]+")
UNKNOWN = "not in its metadata"
LONGEST = 60
"""Characters; longer, the field holds the text of the licence itself."""
STATED = {"cuda-toolkit": "NVIDIA CUDA Toolkit EULA"}
"""Licences by the publisher's documentation of packages whose metadata has none: torch's builds for
CUDA require them."""
FIELDS = ("License-Expression", "License")
CLASSIFIER = "License :: "
Row = dict[str, str]


def packages() -> list[Row]:
    """Return name, version and licence of every installed package below ours, of extras too."""
    found: dict[str, Row] = {}
    waiting = [OURS]
    while waiting:
        name = waiting.pop()
        key = re.sub(r"[-_.]+", "-", name).lower()
        if key in found:
            continue
        try:
            package = distribution(name)
        except PackageNotFoundError:
            continue
        found[key] = {"package": key, "version": package.version, "licence": licence_of(package)}
        waiting += _needed(package)
    return sorted(found.values(), key=lambda row: row["package"])


def licence_of(package: Distribution) -> str:
    """Return what the metadata of a package says: its expression, its field, or its classifiers;
    what `STATED` has where it says nothing."""
    facts = package.metadata
    licence = next((facts[key] for key in FIELDS if key in facts), "")
    line = " ".join(licence.split())
    if line and len(line) <= LONGEST and line.upper() != "UNKNOWN":
        return line
    named = [c.split(" :: ")[-1] for c in facts.get_all("Classifier") or () if CLASSIFIER in c]
    if named or line:
        return "; ".join(named) or f"{line[:LONGEST]}..."
    return STATED.get(package.name.lower(), UNKNOWN)


def data() -> list[Row]:
    """Return what ships or is fetched that is no package."""
    rows: list[Row] = parse_json(DATA.read_bytes())
    return rows


def write_sbom(file: Path, rows: list[Row]) -> None:
    """Write packages and data as CycloneDX JSON; the same packages give the same bytes.

    Raises:
        StoreError: the file cannot be written.
    """
    components = [
        {
            "type": "library",
            "name": row["package"],
            "version": row["version"],
            "purl": f"pkg:pypi/{row['package']}@{row['version']}",
            "licenses": [{"license": {"name": row["licence"]}}],
        }
        for row in rows
    ]
    components += [
        {
            "type": "data",
            "name": row["data"],
            "description": row["what"],
            "licenses": [{"license": {"name": row["licence"]}}],
        }
        for row in data()
    ]
    body = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1, "components": components}
    serial = uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(body, sort_keys=True))
    text = json.dumps({"serialNumber": f"urn:uuid:{serial}", **body}, indent=1, sort_keys=True)
    FileTree(file.parent).write(file.name, text.encode())


def _needed(package: Distribution) -> Iterator[str]:
    """Return the names of the packages that a package requires; of ours, those of every extra."""
    for line in package.requires or ():
        wants_extra = "extra ==" in line.replace("'", '"')
        if wants_extra and package.metadata["Name"].lower() != OURS:
            continue
        if found := NAME.match(line):
            yield found.group()
