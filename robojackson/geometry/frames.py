"""The only axis changes of the project.

world: x forward, y left, z up.  camera: x right, y down, z forward.  SMPL rest: x left, y up, z
forward.  y_up (TRC, AIST++): x right or forward by the file, y up.  Every matrix takes column
vectors: v_to = M @ v_from.
"""

import numpy as np

SMPL_TO_WORLD = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
CAMERA_TO_WORLD = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""A level camera that looks along -x of the world, at a person who faces +x and so the camera.

The person's left is at the right of the image: camera x -> world y.
"""
