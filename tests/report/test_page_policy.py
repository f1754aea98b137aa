"""The content security policy of a generated page: its own scripts and styles, and nothing else."""

import base64
import hashlib
import re

from robojackson.report.pages import inline
from robojackson.report.pages.gallery import render_gallery


def digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def test_only_the_scripts_and_styles_of_the_page_run() -> None:
    result = dict(part.split(" ", 1) for part in inline.policy(["a()"], ["b {}"]).split("; "))
    assert result["default-src"] == "'none'"
    assert result["script-src"] == digest("a()")
    assert result["style-src"] == digest("b {}")
    assert "unsafe" not in inline.policy(["a()"], ["b {}"])
    assert {result["base-uri"], result["form-action"]} == {"'none'"}


def test_a_page_bears_the_digests_of_what_stands_in_it() -> None:
    page = render_gallery([])
    result = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert result
    policy = result[1].replace("&#39;", "'")
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    styles = re.findall(r"<style>(.*?)</style>", page, re.DOTALL)
    assert styles
    assert [text for text in (*scripts, *styles) if digest(text) not in policy] == []
