"""What a file is by its first bytes, in words, for the message where another kind is expected."""

import re

NETWORKS = "networks (safetensors)"
TABLE = "a table (Parquet)"
SOUND = "sound without pictures"
_KINDS = (
    (rb"\x89PNG|\xff\xd8\xff|BM....\0\0\0\0|II\*\0|MM\0\*|RIFF....WEBP", "a picture"),
    (rb"PAR1", TABLE),
    (rb"ID3|fLaC|RIFF....WAVE", SOUND),
    (rb"......\0\0\{", NETWORKS),  # the length of a header below 2^48 bytes, and its first brace
    (rb"PK\x03\x04", "a zip archive"),
    (rb"%PDF", "a PDF"),
    (rb"\s*[\[{]\s*[\"\]}\[{\d-]", "JSON"),
)


def kind_of(data: bytes) -> str:
    """Return what data are, with an article; empty where that is not known."""
    head = data[:64]
    return next((kind for start, kind in _KINDS if re.match(start, head, re.DOTALL)), "")
