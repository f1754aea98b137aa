"""Our camera geometry against the official HybrIK's own numbers.

    python -m benchmarks.mocap.lifting FILE.pt ...     (default: all in $ROBOJACKSON_PAPER)

The files are outputs of the official code as NIKI's demo keeps them (`vis_tmp.pt`): (u, v, d), box
and camera of every frame beside the joints that the official code made of them. Rows: largest
difference of our joints and pelvis to theirs; what our `refine_scale` does to their refined scale
(nothing, with the same bones); how far the person before one fixed lens is from the pixels.
"""

import argparse
import os
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from robojackson.formats.containers import safe_pickle
from robojackson.mocap.landmarks.pinhole_camera import Pinhole, guess_focal
from robojackson.mocap.networks import crop_to_camera, person_crop
from robojackson.mocap.networks.smpl_body import measured_rest

FPS = 30.0
DEPTH_CUTOFF_HZ = 1.5


def measure(path: Path) -> dict[str, float]:
    """Return all figures of one file."""
    content = safe_pickle.load_joblib(path.read_bytes(), path.name)
    rows = {name: np.asarray(content[name], float) for name in ("pred_uvd", "pred_xyz_29")}
    uvd, local = (table.reshape(-1, 29, 3) for table in rows.values())
    root = np.asarray(content["pred_cam_root"], float).reshape(-1, 3)
    low, high = np.asarray(content["bbox"], float).reshape(-1, 2, 2).swapaxes(0, 1)
    boxes = np.concatenate([(low + high) / 2.0, (high - low)[:, :1]], 1)
    width, height = (int(np.ravel(content[name])[0]) for name in ("width", "height"))
    view = crop_to_camera.View(boxes, width, height)
    scale = crop_to_camera.FOCAL_PX / (
        person_crop.SIDE_PX * (root[:, 2] - crop_to_camera.DEPTH_M * uvd[:, 0, 2])
    )
    points = crop_to_camera.lift(uvd, scale, view)
    sigma = np.asarray(content["pred_sigma"], float).reshape(-1, 29)
    twist = np.asarray(content["pred_phi"], float).reshape(-1, 23, 2)
    again = crop_to_camera.refine_scale(uvd, scale, sigma, twist, measured_rest(points)[None], view)
    lens = Pinhole(guess_focal(width, height), width, height)
    fixed = crop_to_camera.refocus(points, view, lens, FPS, DEPTH_CUTOFF_HZ)
    off = np.linalg.norm(lens.project(fixed) - person_crop.to_image(uvd[..., :2], boxes), axis=-1)
    return {
        "frames": float(len(uvd)),
        "joints um": 1e6 * np.abs(points - points[:, :1] - crop_to_camera.DEPTH_M * local).max(),
        "pelvis um": 1e6 * np.abs(points[:, 0] - root).max(),
        "scale, median": float(np.median(again / scale)),
        "fixed lens, median % of the box": 100.0 * float(np.median(off / boxes[:, 2:])),
    }


def main() -> None:
    """Measure files of official outputs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("files", type=Path, nargs="*")
    files = parser.parse_args().files
    folder = os.environ.get("ROBOJACKSON_PAPER", "")
    if not files and not folder:
        parser.error("no FILE given, and ROBOJACKSON_PAPER names no folder")
    table = Table("file", "frames", "joints um", "pelvis um", "scale", "fixed lens %")
    for path in files or sorted(Path(folder).glob("*.pt")):
        table.add_row(path.stem, *(f"{value:.3g}" for value in measure(path).values()))
    Console().print(table)


if __name__ == "__main__":
    main()
