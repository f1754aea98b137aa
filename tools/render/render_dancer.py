"""Render a motion file as a video of a person, with the exact 3D joints beside it.

    python -m tools.render.render_dancer humanoid3d_dance_b.txt -o clips/dance_b --yaw 20
    python -m tools.render.render_dancer hip_shake.txt -o out/tall --phenotype height=0.8 gender=1

Reads DeepMimic's format (`tools/render/deepmimic.py`), poses Anny's body
(`tools/render/anny_body.py`), draws with EGL on any machine (`tools/render/dance_floor.py`). Writes
OUT.mp4 and OUT_gt.npz with: joints (T, 12, 3) and names; all_bones (T, 104, 3) and bone_names;
view and proj, the camera's matrices; fps. Metres, z up, the body faces -y, the floor at z = 0.
Needs `tools/requirements.txt`.
"""

import argparse
import logging
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import imageio_ffmpeg
import numpy as np

from tools.render import dance_floor, deepmimic
from tools.render.anny_body import DANCER, JOINT_BONES, Body, PosedBody

EVEN = 2
"""Sides of a picture are multiples of this, pixels."""
logger = logging.getLogger("render_dancer")


@dataclass(frozen=True)
class Shot:
    """Camera and length of a rendered clip.

    Attributes:
        yaw: Degrees that the camera goes around the dancer; 0 is the front.
        loops: Cycles of the motion.
        fps: Frames a second of the video.
        width, height: Pixels.
        quality: Constant rate factor of H.264; lower is better and larger.
    """

    yaw: float = 0.0
    loops: int = 1
    fps: int = 30
    width: int = 640
    height: int = 480
    quality: int = 18

    def __post_init__(self) -> None:
        """Raise `ValueError` where a side is odd: the colours of H.264 have half its pixels."""
        if self.width % EVEN or self.height % EVEN:
            raise ValueError(f"{self.width} x {self.height} pixels: both sides must be even")


def render(motion_file: Path, out: Path, shot: Shot, phenotype: dict[str, float]) -> None:
    """Write OUT.mp4 and OUT_gt.npz."""
    body = Body(phenotype)
    posed = body.posed(deepmimic.read(motion_file, shot.fps, shot.loops))
    hips = posed.bones[:, body.bone_names.index("root")]
    camera = dance_floor.camera_for(hips, shot.yaw, shot.width, shot.height)
    pictures = dance_floor.frames(posed, dance_floor.colours(body), camera, shot.width, shot.height)
    write_video(out.with_name(out.name + ".mp4"), pictures, shot)
    write_truth(out.with_name(out.name + "_gt.npz"), body, posed, camera, shot.fps)
    logger.info("%s.mp4: %d frames", out, len(posed.vertices))


def write_video(path: Path, pictures: Iterable[np.ndarray], shot: Shot) -> None:
    """Write H.264 that browsers play, from RGB pictures."""
    writer = imageio_ffmpeg.write_frames(
        str(path),
        (shot.width, shot.height),
        fps=shot.fps,
        codec="libx264",
        quality=None,
        macro_block_size=EVEN,  # imageio stretches to a multiple of it, by default of 16
        output_params=["-crf", str(shot.quality), "-preset", "slow", "-movflags", "+faststart"],
    )
    writer.send(None)
    for picture in pictures:
        writer.send(picture)
    writer.close()


def write_truth(
    path: Path, body: Body, posed: PosedBody, camera: dance_floor.Camera, fps: int
) -> None:
    """Write the joints that the video shows, and the camera that shows them."""
    columns = [body.bone_names.index(bone) for bone in JOINT_BONES.values()]
    np.savez_compressed(
        path,
        joints=posed.bones[:, columns],
        names=np.array(list(JOINT_BONES)),
        all_bones=posed.bones,
        bone_names=np.array(body.bone_names),
        view=camera.view,
        proj=camera.projection,
        fps=np.array(fps),
    )


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("motion", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True, help="path without a suffix")
    for name, default in vars(Shot()).items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    parser.add_argument("--phenotype", nargs="*", default=[], metavar="NAME=0..1")
    options = vars(parser.parse_args(arguments))
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    chosen = (item.split("=", 1) for item in options.pop("phenotype"))
    phenotype = {**DANCER, **{name: float(value) for name, value in chosen}}
    render(options.pop("motion"), options.pop("out"), Shot(**options), phenotype)
    return 0


if __name__ == "__main__":
    sys.exit(main())
