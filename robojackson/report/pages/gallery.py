"""The gallery: all dances of a store on one page, to filter and to sort."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from robojackson.report.pages import inline
from robojackson.report.quantities import Quantity, quantities

SHOWN = ("strict_success", "survived_s", "skill", "site_error_m", "limb_gain")
SORTS = {
    "finished": "latest",
    "strictSuccess": "strict success",
    "survivedS": "survival",
    "skill": "skill",
    "limbGain": "limb gain",
}
"""Sort orders by their names on the page, largest first."""
ORDERED = ("strict_success", "survived_s", "skill", "limb_gain")


@dataclass(frozen=True)
class GalleryRun:
    """A dance.

    Attributes:
        dance, robot, setup, seed: Names and numbers of the run.
        finished_at: Time of its end.
        summary: Figures of the evaluation.
        page, live: Addresses relative to the gallery, or empty.
        thumbnail: JPEG as base64, or empty.
    """

    dance: str
    robot: str
    setup: str
    seed: int
    finished_at: datetime
    summary: Mapping[str, object]
    page: str = ""
    live: str = ""
    thumbnail: str = ""

    @property
    def figures(self) -> list[Quantity]:
        """Return the figures that are shown."""
        found = {key: self.summary[key] for key in SHOWN if self.summary.get(key) is not None}
        return quantities(found)

    @property
    def order(self) -> dict[str, float | str]:
        """Return the sort keys."""
        found = {key: _number(self.summary.get(key)) for key in ORDERED}
        return {"finished": self.finished_at.timestamp(), **found}


def render_gallery(runs: Sequence[GalleryRun]) -> str:
    """Return the gallery as HTML, one file with everything except the linked pages."""
    styles, scripts = [inline.own("page.css")], [inline.own("gallery.js")]
    filters = {
        key: sorted({str(getattr(r, key)) for r in runs}) for key in ("dance", "robot", "setup")
    }
    return inline.render(
        "gallery.html",
        styles,
        scripts,
        security=inline.policy(scripts, styles),
        entries=sorted(runs, key=lambda run: run.finished_at, reverse=True),
        filters=filters,
        sorts=SORTS,
    )


def _number(value: object) -> float | str:
    """Return a sort key; empty where there is no figure, which comes last."""
    return float(value) if isinstance(value, int | float) and value == value else ""
