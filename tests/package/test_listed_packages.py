"""pyproject.toml lists its packages by name: none is forgotten, none is gone."""

import tomllib

from tests.package.conftest import ROOT

LIBRARY = "robojackson"
APP = ("configs", "flows", "storage", "tasks")


def folders_with_modules(top: str) -> set[str]:
    """Return the folders with modules as names of packages, `top` included."""
    parents = {path.parent.relative_to(ROOT) for path in (ROOT / top).rglob("*.py")}
    return {folder.as_posix().replace("/", ".") for folder in parents}


def test_every_folder_with_modules_is_a_listed_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    listed = set(project["tool"]["setuptools"]["packages"])
    app = {f"robojackson._app.{name}" for top in APP for name in folders_with_modules(top)}
    assert {name for name in folders_with_modules(LIBRARY) | app if name not in listed} == set()
    assert listed - folders_with_modules(LIBRARY) - app == {
        "robojackson._app",
        "robojackson._app.clips",
    }
