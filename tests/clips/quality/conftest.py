"""The folder of difficult clips."""

from pathlib import Path

import pytest

from tests.fixtures import difficult_clips


@pytest.fixture(scope="session")
def difficult(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of difficult clips, in which the choice is obvious to a person."""
    folder = tmp_path_factory.mktemp("difficult")
    difficult_clips.make(folder)
    return folder
