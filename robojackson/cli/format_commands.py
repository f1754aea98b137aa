"""`robojackson export` and `import`: motions in the file formats of other projects."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer.core import TyperCommand

from robojackson.cli.console import CommandResult, command, log_to_stderr, to_json_types
from robojackson.cli.options import Config, Folder, Json, MotionRobot, Set, overrides_from


class ExportCommand(TyperCommand):
    """The command `export`, whose help lists the formats; only the help searches for them."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        from robojackson.cli.exporting import names

        option = next(p for p in self.params if p.name == "to")
        option.help = f"The format (docs/formats.md). Of {'; of '.join(names())}."  # type: ignore[attr-defined]
        super().format_help(ctx, formatter)


@command
def export(
    motion: Annotated[
        Path,
        typer.Argument(
            help="reference.parquet of a robot, smpl.parquet of a person, a policy, or for deploy "
            "the tracker regulator_onboard."
        ),
    ],
    to: Annotated[str, typer.Option(help="The format.")],
    out: Annotated[
        Path, typer.Option("-o", "--out", help="File for the result; for deploy a folder.")
    ],
    robot: MotionRobot = None,
    reference: Annotated[
        Path | None,
        typer.Option(help="deploy: the motion; needed where it is not beside the policy."),
    ] = None,
    evaluation: Annotated[
        Path | None,
        typer.Option(help="deploy: evaluation.json, where it is not beside the policy."),
    ] = None,
    licence: Annotated[
        list[str] | None,
        typer.Option(help="deploy: a licence that no file records: --licence clip=CC-BY-4.0."),
    ] = None,
    as_json: Json = False,
) -> CommandResult:
    """Write a motion or a policy in another project's format."""
    from robojackson.cli import exporting

    log_to_stderr()
    pack = exporting.PackInputs(reference, evaluation, exporting.licences_from(licence or []))
    made = exporting.export(motion, to, out, robot, pack)
    return CommandResult(made, text=_text(made))


@command
def import_(
    file: Annotated[
        Path,
        typer.Argument(help="HybrIK's res.pk or NIKI's .pt, AMASS, AIST++, GVHMR, BVH or our csv."),
    ],
    out: Folder,
    fps: Annotated[
        float | None,
        typer.Option(min=1.0, max=1000.0, help="Frames a second, where the file has none."),
    ] = None,
    up: Annotated[
        Literal["y", "z"] | None, typer.Option(help="Axis that points up, where it is unusual.")
    ] = None,
    config: Config = "base",
    set_: Set = None,
    as_json: Json = False,
) -> CommandResult:
    """Read a human motion of another project: smpl.parquet on the floor; runs nothing in a file."""
    from robojackson.cli.importing import import_motion

    log_to_stderr()
    made = import_motion(file, out, fps, up, config, overrides_from(set_))
    return CommandResult(made, text=_text(made))


def _text(made: Mapping[str, Any]) -> list[str]:
    """Return the figures of an import, then the verdict and the next command."""
    from robojackson.cli.cards import closing
    from robojackson.cli.console import lines

    figures = {key: value for key, value in made.items() if key not in ("verdict", "next")}
    return [*lines(to_json_types(figures)), *closing(made)]
