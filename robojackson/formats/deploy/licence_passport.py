"""The licence passport: the inputs of a policy, their licences, and what these allow.

No legal advice: it lists what is known. An unrecorded licence is `unknown`, and one unknown input
makes the whole unknown.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from importlib.metadata import PackageNotFoundError, PackagePath
from importlib.metadata import files as package_files
from importlib.metadata import metadata as package_metadata
from pathlib import Path
from typing import Literal

from robojackson.errors import BadConfiguration
from robojackson.robot.description import RobotDescription
from robojackson.robot.mjcf import added_folder

Answer = Literal["yes", "notice", "share-alike", "no", "unknown"]
RIGHTS = ("use", "change", "pass_on", "sell")
ORDER: tuple[Answer, ...] = ("yes", "notice", "share-alike", "unknown", "no")
"""Answers from the freest to the strictest; the strictest one applies to the whole."""
UNKNOWN, TEXTS = "unknown", "licences"
ALLOWS: Mapping[str, tuple[Answer, Answer, Answer, Answer]] = {
    "own": ("yes", "yes", "yes", "yes"),
    "CC0-1.0": ("yes", "yes", "yes", "yes"),
    "Apache-2.0": ("yes", "notice", "notice", "notice"),
    "MIT": ("yes", "yes", "notice", "notice"),
    "BSD-2-Clause": ("yes", "yes", "notice", "notice"),
    "BSD-3-Clause": ("yes", "yes", "notice", "notice"),
    "Zlib": ("yes", "notice", "notice", "notice"),
    "CC-BY-4.0": ("yes", "notice", "notice", "notice"),
    "CC-BY-SA-4.0": ("yes", "share-alike", "share-alike", "share-alike"),
    "CC-BY-NC-4.0": ("notice", "notice", "notice", "no"),
    "CC-BY-NC-SA-4.0": ("notice", "share-alike", "share-alike", "no"),
    "CC-BY-ND-4.0": ("yes", "no", "notice", "notice"),
    "CC-BY-NC-ND-4.0": ("notice", "no", "notice", "no"),
}
"""Rights that a licence grants, in the order of `RIGHTS`; a licence that is not listed is
unknown."""
DECLARED, OF_CLIP = "declared by the user", "whose licence it has"
"""Note of a licence that the user gave; end of the note of an input that has the clip's."""
NOTHING_KNOWN: tuple[Answer, ...] = ("unknown", "unknown", "unknown", "unknown")
KINDS = ("clip", "body models", "motion", "weights", "robot model", "tracker", "software")
RUNNER_NEEDS: Mapping[str, str] = {
    "mujoco": "Apache-2.0",
    "numpy": "BSD-3-Clause",
    "onnxruntime": "MIT",
}
"""Packages that run.py imports, with the licences of their projects."""
WORDS = {
    "yes": "yes",
    "notice": "yes, with its notice",
    "share-alike": "yes, under the same licence",
    "no": "no",
    "unknown": "unknown",
}


@dataclass(frozen=True)
class Ingredient:
    """One input of a policy.

    Attributes:
        kind: One of `KINDS`.
        name: Name of the input.
        licence: SPDX identifier, several with AND between them, `own`, or `unknown`.
        note: Source of the licence, or what is open.
        sha256: Digest of the file, where it is known.
    """

    kind: str
    name: str
    licence: str = UNKNOWN
    note: str = ""
    sha256: str = ""

    @property
    def allows(self) -> dict[str, Answer]:
        """Return what the licence allows."""
        parts = (ALLOWS.get(one, NOTHING_KNOWN) for one in self.licence.split(" AND "))
        return _strictest(dict(zip(RIGHTS, answers, strict=True)) for answers in parts)

    @property
    def is_known(self) -> bool:
        """Return whether it is known what the licence allows."""
        return UNKNOWN not in self.allows.values()


def with_declared(
    ingredients: Iterable[Ingredient], declared: Mapping[str, str]
) -> list[Ingredient]:
    """Return the ingredients with the licences that the user declared by kind; one that has the
    clip's licence (`OF_CLIP`) has the declared one, too.

    Raises:
        BadConfiguration: no such kind.
    """
    found = list(ingredients)
    for kind, licence in sorted(declared.items(), key=lambda one: one[0] == "clip"):
        if kind not in KINDS:
            raise BadConfiguration(f"--licence {kind}={licence}: kinds are {', '.join(KINDS)}")
        mine = [one for one in found if one.kind == kind and not one.is_known]
        found = [one for one in found if one not in mine]
        if kind == "clip":
            found = [_as_the_clip(one, licence) for one in found]
        found += [replace(one, licence=licence, note=DECLARED) for one in mine]
        found += [] if mine else [Ingredient(kind, kind, licence, DECLARED)]
    return sorted(found, key=lambda one: KINDS.index(one.kind))


def _as_the_clip(ingredient: Ingredient, licence: str) -> Ingredient:
    """Return an input with the licence that the clip has now, where it has the clip's."""
    if ingredient.is_known or not ingredient.note.endswith(OF_CLIP):
        return ingredient
    return replace(ingredient, licence=licence, note=f"{ingredient.note}: {DECLARED}")


def together(ingredients: Iterable[Ingredient]) -> dict[str, Answer]:
    """Return what all licences together allow: the strictest answer of each right."""
    return _strictest(one.allows for one in ingredients)


def _strictest(answers: Iterable[Mapping[str, Answer]]) -> dict[str, Answer]:
    """Return the strictest answer of each right."""
    every = list(answers)
    return {right: max((one[right] for one in every), key=ORDER.index) for right in RIGHTS}


def robot_ingredient(description: RobotDescription, sha256: str) -> Ingredient:
    """Return the robot's model with the licence of the package that it comes from."""
    name, source = f"model of {description.name}", description.source
    if source is not None:
        note = f"{source.package} {source.version}; its text is in {TEXTS}"
        note += f"; {source.copyright}" if source.copyright else ""
        return Ingredient("robot model", name, source.licence, note, sha256)
    package, colon, _ = description.mjcf.partition(":")
    if not colon or not package.isidentifier():
        return Ingredient("robot model", name, UNKNOWN, "a file of the user's own", sha256)
    return Ingredient("robot model", name, _of_package(package), f"bundled with {package}", sha256)


def runner_ingredients(network: bool) -> list[Ingredient]:
    """Return the packages that run.py needs, with a network or without: installed beside a pack, no
    part of it."""
    note = "run.py imports it; installed beside the pack, no part of it; bundles works of others"
    return [Ingredient("software", name, licence, note) for name, licence in RUNNER_NEEDS.items()
            if network or name != "onnxruntime"]  # fmt: skip


def licence_texts(description: RobotDescription) -> dict[str, bytes]:
    """Return the available licence files of a robot's model by their names in a pack: `robots add`
    unpacks those of a wheel beside the model."""
    folder = added_folder(description) / TEXTS
    files = sorted(folder.iterdir()) if description.source and folder.is_dir() else []
    package = description.mjcf.partition(":")[0]
    if description.source is None and package.isidentifier():
        files = [Path(str(file.locate())) for file in _files_of(package)]
    return {f"{TEXTS}/{file.name}": file.read_bytes() for file in files if file.is_file()}


def _files_of(package: str) -> list[PackagePath]:
    """Return the licence files that a package was installed with."""
    try:
        found = package_files(package) or []
    except PackageNotFoundError:
        return []
    return [file for file in found if file.name.upper().startswith(("LICENSE", "LICENCE"))][:1]


def _of_package(package: str) -> str:
    try:
        metadata = package_metadata(package).json
    except PackageNotFoundError:
        return UNKNOWN
    words = str(metadata.get("license_expression") or metadata.get("license") or "").split("\n")[0]
    return next((one for one in ALLOWS if one == words.strip().removesuffix(" License")), UNKNOWN)


def passport_json(ingredients: list[Ingredient]) -> bytes:
    """Return `licences.json`."""
    rows = [asdict(one) | {"allows": one.allows} for one in ingredients]
    return json.dumps({"inputs": rows, "together": together(ingredients)}, indent=1).encode()


def passport_markdown(ingredients: list[Ingredient]) -> bytes:
    """Return `LICENCES.md`."""
    lines = [
        "# Licence passport",
        "",
        "What this policy was made from and what the licences allow. No legal advice; `unknown`",
        "means that no record exists: find out before you pass this pack on or sell it.",
        "",
        "| input | what | licence | use | change | pass on | sell | known from |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in ingredients:
        cells = [one.kind, one.name, one.licence, *(WORDS[one.allows[r]] for r in RIGHTS), one.note]
        lines.append("| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |")
    whole = [WORDS[answer] for answer in together(ingredients).values()]
    lines.append("| " + " | ".join(["**together**", "", "", *whole, ""]) + " |")
    return ("\n".join(lines) + "\n").encode()
