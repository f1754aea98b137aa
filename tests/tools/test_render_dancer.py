"""A rendered clip has the size that its camera was computed for."""

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from robojackson.clips.video import VideoLimits, probe

ROOT = Path(__file__).parents[2]


@pytest.fixture
def render_dancer(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the module, which draws nothing here."""
    monkeypatch.setitem(sys.modules, "moderngl", ModuleType("moderngl"))
    from tools.render import render_dancer

    return render_dancer


WRITE = """
import sys
from pathlib import Path
from types import ModuleType

import numpy as np

sys.modules["moderngl"] = ModuleType("moderngl")
from tools.render import render_dancer

out, width, height = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
shot = render_dancer.Shot(width=width, height=height)
render_dancer.write_video(out, [np.zeros((height, width, 3), np.uint8)] * 5, shot)
"""
"""In a process of its own: imageio forks, which the kernel refuses to one with much memory."""


@pytest.mark.parametrize(("width", "height"), [(500, 300), (64, 48)])
def test_a_picture_is_not_stretched(tmp_path: Path, width: int, height: int) -> None:
    file = tmp_path / "shot.mp4"
    command = [sys.executable, "-c", WRITE, str(file), str(width), str(height)]
    subprocess.run(command, check=True, cwd=ROOT, timeout=120)
    info = probe(file, VideoLimits())
    assert (info.width, info.height) == (width, height)


def test_an_odd_side_is_refused(render_dancer: ModuleType) -> None:
    with pytest.raises(ValueError, match="641 x 480 pixels: both sides must be even"):
        render_dancer.Shot(width=641)
