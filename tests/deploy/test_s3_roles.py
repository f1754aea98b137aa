"""The S3 server of the compose file, as a process: each role may do its work and nothing else."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import grpc
import psutil
import pytest
import s3fs

from tools.stack.compose_stack import ROLES, Stack
from tools.stack.service import ROOT

pytestmark = pytest.mark.xdist_group("s3_roles")

BUCKET = "robojackson"
KEY = f"{BUCKET}/motion/0a/a b ä.bin"
CONTENT = bytes(range(256)) * 40_000
"""10 MB: several chunks of the server."""
READERS = ("server", "backup")
SERVICES = {"setup": "setup", "worker": "trainer", "server": "prefect-server", "backup": "backup"}
"""A service of each role."""
PUT_IDENTITY = "/messaging_pb.SeaweedS3IamCache/PutIdentity"
POLICY = (
    '{"Version": "2012-10-17", "Statement": [{"Effect": "Allow", "Principal": "*", '
    '"Action": "s3:*", "Resource": "arn:aws:s3:::robojackson/*"}]}'
)


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """Yield a stack of which only the S3 server runs."""
    made = Stack(tmp_path_factory.mktemp("stack"))
    try:
        made.start("s3")
        yield made
    finally:
        made.down()
        made.remove()


def endpoint(stack: Stack) -> str:
    return f"http://127.0.0.1:{stack.ports['s3']}"


def system(stack: Stack, key: str, secret: str) -> s3fs.S3FileSystem:
    options = {"endpoint_url": endpoint(stack), "region_name": "us-east-1"}
    return s3fs.S3FileSystem(
        key=key,
        secret=secret,
        client_kwargs=options,
        use_listings_cache=False,
        skip_instance_cache=True,
    )


def role(stack: Stack, name: str) -> s3fs.S3FileSystem:
    """Return the bucket as a role reaches it, with the keys of a service of that role."""
    given = stack.file[SERVICES[name]]["environment"]
    assert given["AWS_ACCESS_KEY_ID"] == name
    return system(stack, name, given["AWS_SECRET_ACCESS_KEY"])


@pytest.fixture(scope="module")
def bucket(stack: Stack) -> Stack:
    """Return the stack with its bucket and a file in it."""
    role(stack, "setup").makedirs(BUCKET, exist_ok=True)
    role(stack, "worker").pipe_file(KEY, CONTENT)
    return stack


@pytest.mark.medium
def test_the_roles_have_different_passwords(stack: Stack) -> None:
    passwords = {
        stack.file[SERVICES[name]]["environment"]["AWS_SECRET_ACCESS_KEY"] for name in ROLES
    }
    assert len(passwords) == len(ROLES)


@pytest.mark.medium
def test_setup_makes_the_bucket_as_often_as_it_runs(stack: Stack, tmp_path: Path) -> None:
    words = "from storage.store import Store; Store.from_environment().create().require_writable()"
    for _ in range(2):
        run = subprocess.run(
            [sys.executable, "-c", words],
            env=stack._environment("setup", "setup"),
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stderr


@pytest.mark.medium
def test_a_worker_writes_reads_lists_and_removes(bucket: Stack) -> None:
    worker = role(bucket, "worker")
    assert worker.cat_file(KEY) == CONTENT
    worker.pipe_file(f"{BUCKET}/new", b"")
    assert worker.isfile(f"{BUCKET}/new")
    worker.rm_file(f"{BUCKET}/new")
    assert not worker.isfile(f"{BUCKET}/new")
    assert worker.find(BUCKET) == [KEY]
    worker.makedirs(BUCKET, exist_ok=True)


@pytest.mark.medium
@pytest.mark.parametrize("name", READERS)
def test_a_reader_reads_and_lists(name: str, bucket: Stack) -> None:
    reader = role(bucket, name)
    assert reader.cat_file(KEY) == CONTENT
    assert reader.find(BUCKET) == [KEY]


WRITES: dict[str, tuple[str, dict[str, Any]]] = {
    "put": ("put_object", {"Bucket": BUCKET, "Key": "x", "Body": b"x"}),
    "replace": ("put_object", {"Bucket": BUCKET, "Key": KEY.partition("/")[2], "Body": b"x"}),
    "copy": ("copy_object", {"Bucket": BUCKET, "Key": "x", "CopySource": KEY}),
    "multipart": ("create_multipart_upload", {"Bucket": BUCKET, "Key": "x"}),
    "delete": ("delete_object", {"Bucket": BUCKET, "Key": KEY.partition("/")[2]}),
}
ADMINISTRATION: dict[str, tuple[str, dict[str, Any]]] = {
    "make another bucket": ("create_bucket", {"Bucket": "other"}),
    "delete the bucket": ("delete_bucket", {"Bucket": BUCKET}),
    "let all in by policy": ("put_bucket_policy", {"Bucket": BUCKET, "Policy": POLICY}),
    "let all in by list": ("put_bucket_acl", {"Bucket": BUCKET, "ACL": "public-read"}),
    "write elsewhere": ("put_object", {"Bucket": "other", "Key": "x", "Body": b"x"}),
    "list elsewhere": ("list_objects_v2", {"Bucket": "other"}),
}


@pytest.mark.medium
@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("call", WRITES)
def test_a_reader_writes_nothing(name: str, call: str, bucket: Stack) -> None:
    method, words = WRITES[call]
    with pytest.raises(PermissionError):
        role(bucket, name).call_s3(method, **words)
    assert role(bucket, "worker").find(BUCKET) == [KEY]
    assert role(bucket, "worker").cat_file(KEY) == CONTENT


@pytest.mark.medium
@pytest.mark.parametrize("name", ["worker", *READERS])
@pytest.mark.parametrize("call", ADMINISTRATION)
def test_none_but_setup_administers(name: str, call: str, bucket: Stack) -> None:
    method, words = ADMINISTRATION[call]
    with pytest.raises(PermissionError):
        role(bucket, name).call_s3(method, **words)


@pytest.mark.medium
@pytest.mark.parametrize("call", ["make another bucket", "write elsewhere", "list elsewhere"])
def test_setup_has_no_rights_beside_the_bucket(call: str, bucket: Stack) -> None:
    method, words = ADMINISTRATION[call]
    with pytest.raises(PermissionError):
        role(bucket, "setup").call_s3(method, **words)


@pytest.mark.medium
@pytest.mark.parametrize("method", ["GET", "PUT", "DELETE"])
@pytest.mark.parametrize("path", ["", f"/{BUCKET}", f"/{BUCKET}/x", "/other"])
def test_without_a_key_all_is_forbidden(path: str, method: str, bucket: Stack) -> None:
    if not path and method != "GET":
        path = f"/{BUCKET}/y"  # a service has nothing but its list
    body = b"x" if method == "PUT" else None
    with pytest.raises(HTTPError) as refused:
        urlopen(Request(endpoint(bucket) + path, data=body, method=method), timeout=10)
    assert refused.value.code == 403


@pytest.mark.medium
@pytest.mark.parametrize(("key", "secret"), [("worker", "wrong"), ("root", ""), ("x", "y")])
def test_a_wrong_key_is_forbidden(key: str, secret: str, bucket: Stack) -> None:
    with pytest.raises(PermissionError):
        system(bucket, key, secret or "x").call_s3("list_objects_v2", Bucket=BUCKET)


def message(field: int, value: bytes) -> bytes:
    """Return a field of a protobuf message, shorter than 128 bytes."""
    return bytes([field << 3 | 2, len(value)]) + value


def inner_port(stack: Stack, name: str) -> str:
    words = stack.services["s3"].command
    return next(w.partition("=")[2] for w in reversed(words) if w.startswith(f"-{name}="))


@pytest.mark.medium
def test_the_gateways_own_port_takes_no_identity_from_strangers(bucket: Stack) -> None:
    """Without a signing key it does: any process in the network makes itself an administrator."""
    credential = message(1, b"x") + message(2, b"y")
    identity = message(1, b"x") + message(2, credential) + message(3, b"Admin")
    with grpc.insecure_channel(f"127.0.0.1:{inner_port(bucket, 's3.port.grpc')}") as channel:
        with pytest.raises(grpc.RpcError) as refused:
            channel.unary_unary(PUT_IDENTITY)(message(1, identity), timeout=10)
        assert refused.value.code() == grpc.StatusCode.UNAUTHENTICATED
    with pytest.raises(PermissionError):
        system(bucket, "x", "y").call_s3("list_objects_v2", Bucket=BUCKET)


def listening(stack: Stack) -> dict[str, set[int]]:
    """Return the ports that the server listens on, by address."""
    process = stack.services["s3"].process
    assert process is not None
    found: dict[str, set[int]] = {}
    for connection in psutil.Process(process.pid).net_connections("inet"):
        if connection.status == psutil.CONN_LISTEN:
            found.setdefault(connection.laddr.ip, set()).add(connection.laddr.port)
    return found


@pytest.mark.medium
def test_the_process_listens_on_this_machine_alone(bucket: Stack) -> None:
    assert set(listening(bucket)) == {"127.0.0.1"}


@pytest.mark.medium
def test_only_the_gateway_listens_where_the_file_opens_it(tmp_path: Path) -> None:
    """Filer, volumes and master require no key; 127.0.0.2 is in place of the file's 0.0.0.0."""
    stack = Stack(tmp_path)
    service = stack._service("s3", 0)
    assert "-s3.ip.bind=0.0.0.0" in service.command
    service.command.append("-s3.ip.bind=127.0.0.2")
    service.check = [word.replace("127.0.0.1", "127.0.0.2") for word in service.check or []]
    stack.services["s3"] = service
    try:
        service.start()
        service.wait(60)
        opened = {stack.ports["s3"], int(inner_port(stack, "s3.port.grpc"))}
        assert listening(stack)["127.0.0.2"] == opened
        assert set(listening(stack)) == {"127.0.0.1", "127.0.0.2"}
    finally:
        stack.down()
        stack.remove()


@pytest.mark.medium
def test_a_backup_reads_from_it_once(bucket: Stack, tmp_path: Path) -> None:
    """The second one knows by the server's tags that nothing has changed."""
    given = bucket._environment("backup", "backup") | {
        "PREFECT_SERVER_DATABASE_CONNECTION_URL": "",
        "PREFECT_HOME": str(tmp_path / "none"),
    }
    command = [
        sys.executable,
        "-m",
        "robojackson",
        "backup",
        str(tmp_path / "out"),
        "--json",
    ]
    for copied in (1, 0):
        run = subprocess.run(
            command, env=given, cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stderr
        assert f'"copied": {copied},' in run.stdout
    contents = [path for path in (tmp_path / "out" / "contents").rglob("*") if path.is_file()]
    assert [path.read_bytes() for path in contents] == [CONTENT]


@pytest.mark.medium
def test_what_the_server_writes_is_in_the_stacks_folder(bucket: Stack) -> None:
    process = bucket.services["s3"].process
    assert process is not None
    opened = [Path(file.path) for file in psutil.Process(process.pid).open_files()]
    ours = [path for path in opened if path.parts[1] not in ("proc", "sys")]
    assert ours
    assert [path for path in ours if not path.is_relative_to(bucket.folder)] == []
