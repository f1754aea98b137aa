"""Scripts, styles and data inside one page, under a content security policy of their digests."""

import base64
import gzip
import hashlib
import json
import unicodedata
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources

import jinja2
from markupsafe import Markup

CONTROLS = {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}
"""Bidirectional classes of characters that reverse the order of the text around them."""
PLAIN = "\t\n\r"


@cache
def asset(name: str) -> str:
    """Return a text of `robojackson/assets`."""
    return (resources.files("robojackson") / "assets" / name).read_text("utf-8")


@cache
def compressed_asset(name: str) -> str:
    """Return a file of `robojackson/assets` as base64."""
    content = (resources.files("robojackson") / "assets" / name).read_bytes()
    return base64.b64encode(content).decode()


@cache
def own(name: str) -> str:
    """Return a script, style or template of this package."""
    return (resources.files("robojackson.report.pages") / name).read_text("utf-8")


def policy(scripts: Sequence[str], styles: Sequence[str], wasm: bool = False) -> str:
    """Return the content security policy of a page with exactly these scripts and styles.

    Args:
        wasm: Whether the page compiles WebAssembly.
    """
    allowed = [_digest(script) for script in scripts] + (["'wasm-unsafe-eval'"] if wasm else [])
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src {' '.join(allowed) or chr(39) + 'none' + chr(39)}",
            f"style-src {' '.join(map(_digest, styles))}",
            "img-src data: blob:",
            "media-src blob:",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )


def json_text(data: Mapping[str, object]) -> Markup:
    """Return JSON for the inside of a script element."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return Markup(text.replace("<", "\\u003c"))


def zipped(content: bytes) -> str:
    """Return gzip as base64; a browser's DecompressionStream opens it."""
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def visible(value: object) -> object:
    """Return a text with its invisible and bidirectional characters written out."""
    if isinstance(value, Markup) or not isinstance(value, str):
        return value
    return "".join(f"\\u{ord(c):04x}" if _is_hidden(c) else c for c in value)


def render(template: str, styles: Sequence[str], scripts: Sequence[str], **values: object) -> str:
    """Return a page from a template of this package; every value is escaped.

    Args:
        styles, scripts: Texts inside the page.
    """
    loader = jinja2.FunctionLoader(own)
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, finalize=visible, loader=loader,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template(template).render(
        styles=[Markup(style) for style in styles],
        scripts=[Markup(script) for script in scripts],
        **values,
    )


def _is_hidden(letter: str) -> bool:
    if letter in PLAIN or (letter.isascii() and letter.isprintable()):
        return False
    control = unicodedata.category(letter) in ("Cc", "Co", "Cs")
    return control or unicodedata.bidirectional(letter) in CONTROLS


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
