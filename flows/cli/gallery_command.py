"""The command that builds the gallery of a store.

Like `robojackson.cli.app`, it imports what it needs inside itself.
"""

import base64
from typing import TYPE_CHECKING, Annotated

import typer

from robojackson.cli.console import CommandResult, command
from robojackson.cli.options import Json

if TYPE_CHECKING:
    from robojackson.report.pages.gallery import GalleryRun
    from storage.run_catalogue import Run
    from storage.store import Store

GALLERY, THUMBNAILS = "gallery.html", "gallery"
WIDTH_PX, QUALITY = 360, 75


@command
def gallery(
    dance: Annotated[str | None, typer.Option(help="Only runs of this dance.")] = None,
    as_json: Json = False,
) -> CommandResult:
    """Show all dances of the store on one page; existing thumbnails are not made again."""
    from robojackson.errors import UnknownName
    from robojackson.pipeline.run_names import slug_of
    from robojackson.report.pages.gallery import render_gallery
    from storage.run_catalogue import list_runs
    from storage.store import Store

    store = Store.from_environment()
    known = list_runs(store)
    runs = [run for run in known if dance is None or slug_of(run.move) == slug_of(dance)]
    if known and not runs:
        raise UnknownName("dance", str(dance), store.root, {run.move for run in known})
    made = [_entry(store, run) for run in runs if "evaluation" in run.artifacts]
    page = store.put(GALLERY, render_gallery(made).encode())
    answer = {"page": store.address(page.key), "runs": len(made)}
    return CommandResult(
        answer, text=[f"{len(made)} dance{'s' * (len(made) != 1)}", f"page   {answer['page']}"]
    )


def _entry(store: "Store", run: "Run") -> "GalleryRun":
    from robojackson.report.pages.gallery import GalleryRun

    there = {
        name: run.artifacts[name].key
        for name in ("page", "live")
        if name in run.artifacts and store.exists(run.artifacts[name].key)
    }
    thumbnail = _thumbnail(store, run)
    return GalleryRun(
        run.move, run.robot, run.setup, run.seed, run.finished_at, run.summary,
        there.get("page", ""), there.get("live", ""), thumbnail,
    )  # fmt: skip


def _thumbnail(store: "Store", run: "Run") -> str:
    """Return a small picture of the dance, made once."""
    import io

    from PIL import Image

    still = run.artifacts.get("still")
    if still is None:
        return ""
    key = f"{THUMBNAILS}/{still.sha256[:16]}.jpg"
    if not store.exists(key):
        if not store.exists(still.key):
            return ""
        picture = Image.open(io.BytesIO(store.read(still.key))).convert("RGB")
        picture.thumbnail((WIDTH_PX, WIDTH_PX))
        encoded = io.BytesIO()
        picture.save(encoded, "JPEG", quality=QUALITY)
        store.put(key, encoded.getvalue())
    return base64.b64encode(store.read(key)).decode()
