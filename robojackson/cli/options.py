"""Options that several commands of `robojackson` share, and how they override a configuration."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from robojackson.errors import BadConfiguration

Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Print all figures.")]


def _named(folder: str = "") -> Callable[[str], list[str]]:
    """Return a function that completes the names of a kind of configuration; the shell completes
    paths."""

    def complete(incomplete: str) -> list[str]:
        from robojackson.pipeline.configuration_files import names

        return [name for name in names(folder) if name.startswith(incomplete)]

    return complete


Config = Annotated[
    str,
    typer.Option("--config", help="Name or path of a configuration.", autocompletion=_named()),
]
Setup = Annotated[
    str | None,
    typer.Option(
        help="Name of a setup of configs/setups, or a path.", autocompletion=_named("setups")
    ),
]
TrainConfigFile = Annotated[
    str | None,
    typer.Option(
        "--config",
        help="Name or path of a configuration of `dance`, whose section `train` is used; its "
        "`gate` too.",
        autocompletion=_named(),
    ),
]


def _set(example: str) -> Any:
    return typer.Option("--set", help=f"Change one value: --set {example}.")


Set = Annotated[list[str] | None, _set("train.seed=3")]
SetMocap = Annotated[list[str] | None, _set("mocap.leave_out_weak=true")]
SetRetarget = Annotated[list[str] | None, _set("retarget.tempo=0.8")]
SetTrain = Annotated[list[str] | None, _set("seed=3")]
SetFind = Annotated[list[str] | None, _set("filters.person_height_px=100")]
SetStudy = Annotated[list[str] | None, _set("mode=track")]
Force = Annotated[
    bool, typer.Option("--force", help="Continue with a motion that the gate refuses.")
]


def _folder(text: str) -> Path:
    """Return an existing folder, or the path of one that can be created.

    Raises:
        BadParameter: the text is empty, as from a shell variable that is not set; the path or a
            parent is a file; or the path is invalid or not accessible.
    """
    if not text:
        raise typer.BadParameter("the folder's name is empty; `.` is the current one")
    out = Path(text)
    try:
        found = next((p for p in (out, *out.parents) if p.is_file()), None)
    except OSError as cause:
        raise typer.BadParameter(f"the folder cannot exist: {cause.strerror}") from cause
    if found is not None:
        raise typer.BadParameter(f"{found} is a file; expected a folder")
    return out


def _out(text: str) -> Any:
    return typer.Option("-o", "--out", parser=_folder, metavar="<path>", help=text)


Folder = Annotated[Path, _out("Folder for the results.")]
TablesFolder = Annotated[Path | None, _out("Folder for the tables.")]
Weights = Annotated[
    Path | None, typer.Option(help="Published weights that you bring: docs, official_weights.md.")
]
Start = Annotated[float | None, typer.Option(min=0, help="Trim: begin here, seconds.")]
End = Annotated[float | None, typer.Option(min=0, help="Trim: end here, seconds.")]
SecondVideo = Annotated[
    Path | None, typer.Argument(help="The same dance from another camera; neither may move.")
]
Person = Annotated[
    int | None, typer.Option(min=1, help="Number of the person to follow; 1 is the largest.")
]
Quality = Annotated[
    Literal["lite", "full", "heavy", "best"] | None,
    typer.Option(help="Pose model; best: full and heavy vote, at a third of the speed."),
]
Robot = Annotated[
    str | None,
    typer.Option(
        "--robot",
        help="Name of a robot of configs/robots, or the path of your own YAML.",
        autocompletion=_named("robots"),
    ),
]
MotionRobot = Annotated[
    str | None,
    typer.Option(
        "--robot",
        help="Name or YAML of the robot that the motion is for, where the motion does not name it.",
    ),
]
Trainer = Annotated[
    Literal["sbx", "sb3"] | None, typer.Option(help="sbx (JAX, fast) or sb3 (the reference).")
]
Seed = Annotated[int | None, typer.Option(min=0, help="Seed of the training.")]
Minutes = Annotated[
    float | None,
    typer.Option(
        min=0.01,
        help="Wall time of the whole pass, minutes; 12 by default. Training gets .5 at least.",
    ),
]
TrainMinutes = Annotated[
    float | None,
    typer.Option(min=0.01, help="Wall time, minutes; 9 where neither it nor --steps is given."),
]


def overrides_from(
    pairs: list[str] | None, given: Mapping[str, object] | None = None
) -> dict[str, object]:
    """Return `--set key=value` pairs and given options as one mapping."""
    overrides = {key: value for key, value in (given or {}).items() if value is not None}
    for pair in pairs or []:
        key, equals, value = pair.partition("=")
        if not equals or not key:
            raise BadConfiguration(f"--set {pair}: expected KEY=VALUE; --help has an example")
        overrides[key] = value
    return overrides


def yaml_text(path: Path | str | None) -> str | None:
    """Return a path or a name quoted so that YAML reads it as text."""
    return None if path is None else "'" + str(path).replace("'", "''") + "'"
