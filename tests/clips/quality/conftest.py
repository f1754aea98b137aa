"""The folder of difficult clips."""

from pathlib import Path

import pytest

from tests.fixtures import difficult_clips


@pytest.fixture(scope="session")
def difficult(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of clips of which a person knows at once which to dance."""
    folder = tmp_path_factory.mktemp("difficult")
    difficult_clips.make(folder)
    return folder
