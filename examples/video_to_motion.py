"""A video of a person in, the 3D motion of the body out."""

import sys

import robojackson as rj
from robojackson.pipeline.bundled_clips import bundled

video = sys.argv[1] if len(sys.argv) > 1 else bundled("hip_shake.mp4")
motion = rj.recover_motion(video, progress=True)
print(motion)
print("hips, metres:", motion.joints[:, 0].round(3).tolist()[:3], "...")
motion.save("smpl.parquet")
print("for Blender:", rj.write_motion(motion, "motion.bvh"))
