"""RoboJackson: a video of a dance in, a robot that dances it out.

The science of the project. Importing it opens no file, socket or clock; files are touched only
in adapters that say so (`clips.video`, `clips.pose_detector`, `robot.model`, `rl.policy`,
`report`).
"""

__version__ = "0.1.0"
