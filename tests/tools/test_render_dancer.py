"""A rendered clip has the size that its camera was computed for."""

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from robojackson.clips.video import VideoLimits, probe


@pytest.fixture
def render_dancer(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return the module, which draws nothing here."""
    monkeypatch.setitem(sys.modules, "moderngl", ModuleType("moderngl"))
    from tools.render import render_dancer

    return render_dancer


@pytest.mark.parametrize(("width", "height"), [(500, 300), (64, 48)])
def test_a_picture_is_not_stretched(
    render_dancer: ModuleType, tmp_path: Path, width: int, height: int
) -> None:
    shot = render_dancer.Shot(width=width, height=height)
    pictures = [np.zeros((height, width, 3), np.uint8)] * 5
    render_dancer.write_video(tmp_path / "shot.mp4", pictures, shot)
    info = probe(tmp_path / "shot.mp4", VideoLimits())
    assert (info.width, info.height) == (width, height)


def test_an_odd_side_is_refused(render_dancer: ModuleType) -> None:
    with pytest.raises(ValueError, match="641 x 480 pixels: both sides must be even"):
        render_dancer.Shot(width=641)
