"""Prefect artifacts of a dance or a study: verdict, figures, pictures and links."""

import json
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from prefect.artifacts import acreate_markdown_artifact

from robojackson.clips.web.untrusted_text import in_markdown
from robojackson.pipeline.run_names import slug_of
from robojackson.report.pages.run_page import VERDICT_COLUMNS, headline, verdicts
from robojackson.report.quantities import quantities
from storage.artifact import Artifact
from storage.store import Store

Artifacts = Mapping[str, Artifact]
RESULTS = "/results"
"""Where `robojackson server` hands out files of the store, on the host of its pages."""
OPEN_FOLDERS = ("dances", "studies")
"""Of the store: what is there is made to be looked at."""
LINKS = {"page": "page with plots and video", "dance": "video"}
FIGURES = ("strict_success", "skill", "survived_s")
TABLES = ("evaluations", "episodes", "reference", "smpl", "landmarks", "policy")
"""What the artifact links to, by name."""


async def show_dance(
    store: Store, name: str, evaluation: Mapping[str, Any], made: Artifacts
) -> None:
    """Leave one Markdown artifact under the key `dance-<name>`, which keeps its history.

    Args:
        name: Name of the dance.
        evaluation: Evaluation of the trained policy, with its baselines.
        made: What the pass made, by name; the files are in an open folder.
    """
    key, text = f"dance-{slug_of(name)}", of_dance(store, name, evaluation, made)
    figures = ", ".join(f"{f.label} {f.value}" for f in quantities(evaluation, FIGURES))
    await acreate_markdown_artifact(key=key, markdown=text, description=figures)


async def show_study(store: Store, name: str, made: Artifacts) -> None:
    """Leave one Markdown artifact under the key `study-<name>`.

    Args:
        name: Name of the study.
        made: The files of its page, by name; a picture is a `.png`.
    """
    text = of_study(store, name, made)
    shows = f"What study {name} shows"
    await acreate_markdown_artifact(key=f"study-{slug_of(name)}", markdown=text, description=shows)


def of_study(store: Store, name: str, made: Artifacts) -> str:
    """Return the text about a study: what it shows of each claim, and its pictures."""
    claims = json.loads(store.read(made["results"].key))["claims"]
    parts = [f"# {in_markdown(name)}"]
    parts += [f"**{in_markdown(c['text'])}** {in_markdown(c['sentence'])}" for c in claims]
    parts.append(f"[page with all figures]({address(made['page'])})")
    tables = (f"[{made[key].name}]({address(made[key])})" for key in ("table", "results"))
    parts.append(f"Tables: {', '.join(tables)}")
    pictures = {title: file for title, file in made.items() if file.name.endswith(".png")}
    parts += [f"![{in_markdown(title)}]({address(file)})" for title, file in pictures.items()]
    return _text(store, parts, made)


def of_dance(store: Store, name: str, evaluation: Mapping[str, Any], made: Artifacts) -> str:
    """Return the text about a dance: verdict, picture, figures and links."""
    parts = [f"# {in_markdown(name)}", headline(evaluation)]
    if "still" in made:
        parts.append(f"![source, recovered body, reference and robot]({address(made['still'])})")
    parts.append(table(evaluation))
    links = [f"[{words}]({address(made[key])})" for key, words in LINKS.items() if key in made]
    tables = [f"[{made[key].name}]({address(made[key])})" for key in TABLES if key in made]
    parts += [" · ".join(links), f"Tables: {', '.join(tables)}"]
    return _text(store, parts, made)


def address(artifact: Artifact) -> str:
    """Return where a browser that shows Prefect's pages finds a file of an open folder."""
    return f"{RESULTS}/{quote(artifact.key)}"


def table(evaluation: Mapping[str, Any]) -> str:
    """Return the figures of the policy and its baselines as a Markdown table."""
    heads = ["policy", *(fact.label for fact in quantities(dict.fromkeys(VERDICT_COLUMNS)))]
    rows = [[verdict.title, *verdict.values] for verdict in verdicts(evaluation)]
    return "\n".join(map(_row, [heads, ["---"] * len(heads), *rows]))


def _text(store: Store, parts: Sequence[str], made: Artifacts) -> str:
    folder = store.address(made["page"].key).rpartition("/")[0]
    where = f"Links and pictures need `robojackson server`. The files are in `{folder}`."
    return "\n\n".join([*parts, where]) + "\n"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
