"""Prefect artifacts of a search: the table, the pictures, the link to the chosen video."""

from collections.abc import Mapping
from typing import Any

from prefect.artifacts import (
    acreate_link_artifact,
    acreate_markdown_artifact,
    acreate_table_artifact,
)

from flows.search import ranking_table
from robojackson.clips.web.untrusted_text import clean_text, in_markdown, web_address
from robojackson.pipeline.run_names import slug_of


async def publish_search(
    name: str, rows: list[dict[str, Any]], chosen: Mapping[str, Any] | None
) -> None:
    """Publish three artifacts under keys that stay the same for a dance, so that they have a
    history."""
    slug = slug_of(name)
    caption = f"Videos assessed for {in_markdown(clean_text(name))}"
    table = ranking_table.plain_rows(rows)
    await acreate_table_artifact(key=f"candidates-{slug}", table=table, description=caption)
    text = ranking_table.markdown(name, rows)
    await acreate_markdown_artifact(key=f"pictures-{slug}", markdown=text, description=caption)
    link = web_address(chosen["url"]) if chosen else ""
    if chosen and link:
        await acreate_link_artifact(
            key=f"chosen-{slug}",
            link=ranking_table.in_link(link),
            link_text=in_markdown(clean_text(chosen["title"])),
        )
