"""The ranked table of `robojackson find` as a picture, with a few frames of every video.

python -m robojackson find FOLDER --source folder --top 20 --json > found.json
python -m tools.assets.find_picture found.json docs/images/find.png
"""

import argparse
import json
from pathlib import Path
from typing import Any

import cv2
import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from flows.search.ranking_table import FIGURES
from robojackson.clips.video import read_frames

WIDTH, ROW, HEAD, FRAME = 1500, 76, 44, 88
SHARES = (0.15, 0.5, 0.85)
"""Where in a clip its frames are taken."""
PAPER, INK, FAINT, LINE = (255, 255, 255), (30, 34, 40), (120, 126, 134), (222, 226, 230)
COLOURS = {
    "chosen": (24, 128, 56),
    "accepted": INK,
    "rejected": (176, 58, 46),
    "failed": (176, 58, 46),
}
FIGURES_AT, STEP, REASON_AT = 500, 62, 960
SHOWN = ("score", "sec", "body", "px", "ppl", "cuts", "still")
FONTS = Path(matplotlib.get_data_path()) / "fonts" / "ttf"


def draw(rows: list[dict[str, Any]]) -> Image.Image:
    """Return one row a video."""
    sheet = Image.new("RGB", (WIDTH, HEAD + ROW * len(rows)), PAPER)
    pen = ImageDraw.Draw(sheet)
    small, bold = _font("DejaVuSans.ttf", 15), _font("DejaVuSans-Bold.ttf", 16)
    pen.text((3 * FRAME + 24, 14), "video", FAINT, small)
    pen.text((REASON_AT, 14), "reason", FAINT, small)
    for number, head in enumerate(SHOWN):
        pen.text((FIGURES_AT + STEP * (number + 1), 14), head, FAINT, small, anchor="ra")
    for number, row in enumerate(rows):
        _row(sheet, pen, HEAD + ROW * number, row, small, bold)
    return sheet


def _row(
    sheet: Image.Image,
    pen: ImageDraw.ImageDraw,
    top: int,
    row: dict[str, Any],
    small: Any,
    bold: Any,
) -> None:
    pen.line((0, top, WIDTH, top), LINE)
    for number, picture in enumerate(_frames(Path(row["url"]))):
        sheet.paste(picture, (8 + number * FRAME, top + 5))
    colour, middle = COLOURS[row["decision"]], top + ROW // 2
    pen.text((3 * FRAME + 24, middle - 18), row["title"].removesuffix(".mp4"), colour, bold)
    pen.text((3 * FRAME + 24, middle + 4), row["decision"], colour, small)
    for number, head in enumerate(SHOWN):
        name, form = FIGURES[head]
        text = "-" if row[name] is None else form.format(row[name])
        at = (FIGURES_AT + STEP * (number + 1), middle - 8)
        pen.text(at, text, INK, small, anchor="ra")
    pen.text((REASON_AT, middle - 8), row["reason"] or "", colour, small)


def _frames(path: Path) -> list[Image.Image]:
    images = list(read_frames(path))
    chosen = [images[int(share * len(images))] for share in SHARES]
    return [Image.fromarray(_fitted(image)) for image in chosen]


def _fitted(image: np.ndarray) -> np.ndarray:
    """Return the whole image in the middle of a small one."""
    wide, high = FRAME - 4, ROW - 10
    factor = min(wide / image.shape[1], high / image.shape[0])
    small = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    made = np.full((high, wide, 3), LINE, np.uint8)
    top, left = (high - small.shape[0]) // 2, (wide - small.shape[1]) // 2
    made[top : top + small.shape[0], left : left + small.shape[1]] = small
    return made


def _font(name: str, size: int) -> Any:
    return ImageFont.truetype(str(FONTS / name), size)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("found", type=Path)
    parser.add_argument("out", type=Path)
    given = parser.parse_args()
    rows = json.loads(given.found.read_text())["candidates"]
    draw(rows).save(given.out, optimize=True)


if __name__ == "__main__":
    main()
