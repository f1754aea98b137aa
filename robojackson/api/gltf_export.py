"""A run as one glTF file: dancer, reference and robot side by side, at the same moments."""

from pathlib import Path

import numpy as np

from robojackson.api.run_folder import FPS, read_run
from robojackson.files.file_tree import FileTree
from robojackson.formats.containers.gltf_scene import GltfScene
from robojackson.formats.gltf_person import add_person
from robojackson.formats.gltf_robot import add_robot
from robojackson.report.video.robot_panel import REFERENCE_TINT
from robojackson.report.video.timeline import reference_qpos

APART_M = 1.2
"""Between dancer, reference and robot; the robot stands where the reference is from."""


def write_gltf(folder: Path, out: Path) -> Path:
    """Write the .glb of the folder of a run.

    Raises:
        StoreError: a table of the run is missing, or the file cannot be written.
    """
    run = read_run(folder)
    when, model, scene = run.shown.when, run.robot.model, GltfScene("dance")
    clock = scene.clock(np.arange(len(when)) / FPS)
    frames = np.minimum(when.frame, len(run.sequence) - 1)
    add_person(scene, run.sequence, frames, clock, 2 * APART_M)
    target = reference_qpos(run.reference, when)
    add_robot(scene, model, target, clock, "reference ", REFERENCE_TINT, APART_M)
    add_robot(scene, model, run.rollout[when.rollout], clock, "robot ")
    FileTree(out.parent).write(out.name, scene.to_bytes())
    return out
