"""The command that opens the results of a run, or converts them for other viewers."""

import webbrowser
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from robojackson.cli.console import CommandResult, command
from robojackson.cli.options import Json
from robojackson.errors import BadConfiguration, StoreError

PAGE = "index.html"
SHOWN = (".html", ".mp4", ".m4v", ".mov", ".webm", ".mkv", ".gif", ".webp", ".png", ".jpg", ".jpeg",
         ".svg", ".pdf")  # fmt: skip
"""Files that a browser shows."""


class View(StrEnum):
    """Other formats of a run."""

    GIF = "gif"
    WEBP = "webp"
    RERUN = "rerun"
    GLTF = "gltf"


@command
def view(
    file: Annotated[Path, typer.Argument(help="A page, a live dance, or the folder of a run.")],
    to: Annotated[View | None, typer.Option(help="Write it for another viewer instead.")] = None,
    out: Annotated[Path | None, typer.Option("-o", "--out", help="File to write.")] = None,
    as_json: Json = False,
) -> CommandResult:
    """Open the page of a run; --to writes its video as GIF or WebP, or the run for other viewers.

    rerun is a recording for Rerun (.rrd); gltf is dancer, reference and robot in motion (.glb).
    """
    if to is None:
        if out is not None:
            raise BadConfiguration(f"-o {out} needs --to: {', '.join(View)}")
        page = file / PAGE if file.is_dir() else file
        if not page.is_file():
            raise StoreError(f"{page}: no such file; the folder of a run has its {PAGE}")
        require_kind(page, SHOWN, "page, picture or video")
        opened = webbrowser.open(page.resolve().as_uri())
        word = "opened" if opened else "no browser here; open"
        return CommandResult({"page": str(page), "opened": opened}, text=[f"{word} {page}"])
    if out is None:
        raise BadConfiguration(f"--to {to} writes a file: name it with -o FILE")
    from robojackson.api.motions import require_another

    require_another(file, out)
    folder = file if file.is_dir() else file.parent
    if to is View.RERUN:
        from robojackson.api.rerun_export import write_rerun

        write_rerun(folder, out)
    elif to is View.GLTF:
        from robojackson.api.gltf_export import write_gltf

        write_gltf(folder, out)
    else:
        from robojackson.api.run_folder import FILMS, one_of
        from robojackson.clips.video import SUFFIXES
        from robojackson.report.video.animation import write_animation

        is_film = file.is_file() and file.suffix != ".html"
        if is_film:
            require_kind(file, SUFFIXES, "video")
        write_animation(file if is_film else one_of(folder, FILMS), out, to.value)
    size = out.stat().st_size
    return CommandResult({"file": str(out), "bytes": size}, text=[f"{out}  {size:,} bytes"])


def require_kind(file: Path, endings: tuple[str, ...], kind: str) -> None:
    """Refuse a file of another kind, such as a table.

    Raises:
        BadConfiguration: Its name does not end so.
    """
    if file.suffix.lower() not in endings:
        raise BadConfiguration(
            f"no {kind} ({', '.join(endings)}); name the folder of its run, or write the "
            "folder's motions for another viewer: --to gltf -o FILE.glb",
            file,
        )
