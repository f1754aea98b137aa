"""Variables of the environment that would break a library below us."""

from collections.abc import Iterator

from tests.badinput.base import CLIP
from tests.badinput.case import Case

RETARGET = ("retarget", "@/smpl.parquet", "-o", "out")
METRICS = ("metrics",)
BAD: tuple[tuple[str, str, tuple[str, ...]], ...] = (
    ("MUJOCO_GL", "junk", RETARGET),
    ("MUJOCO_GL", "egl,glfw", RETARGET),
    ("PYOPENGL_PLATFORM", "junk", RETARGET),
    ("JAX_PLATFORMS", "junk", ("train", "@/reference.parquet", "-o", "out")),
    ("JAX_PLATFORMS", "cpu,evil", ("train", "@/reference.parquet", "-o", "out")),
    ("JAX_ENABLE_X64", "maybe", ("train", "@/reference.parquet", "-o", "out")),
    ("JAX_LOG_COMPILES", "maybe", ("train", "@/reference.parquet", "-o", "out")),
    ("JAX_DEFAULT_MATMUL_PRECISION", "junk", ("train", "@/reference.parquet", "-o", "out")),
    ("PREFECT_API_REQUEST_TIMEOUT", "junk", ("dance", str(CLIP))),
    ("XLA_FLAGS", "--evil", ("train", "@/reference.parquet", "-o", "out")),
    ("OMP_NUM_THREADS", "x", RETARGET),
    ("OMP_NUM_THREADS", "-1", RETARGET),
    ("OMP_NUM_THREADS", "99999999", RETARGET),
    ("PREFECT_HOME", "/etc/passwd", ("dance", str(CLIP))),
    ("PREFECT_HOME", "/dev/null/x", ("dance", str(CLIP))),
    ("PREFECT_API_URL", "junk", ("dance", str(CLIP))),
    ("PREFECT_API_URL", "ftp://x/api", ("deploy",)),
    ("PREFECT_API_URL", "http://127.0.0.1:99999/api", ("deploy",)),
    ("PREFECT_API_URL", "http://127.0.0.1:9/api", ("deploy",)),
    ("PREFECT_LOGGING_LEVEL", "LOUD", ("dance", str(CLIP))),
    ("ROBOJACKSON_STORE", "/dev/null", METRICS),
    ("ROBOJACKSON_STORE", "/dev/null/store", METRICS),
    ("ROBOJACKSON_STORE", "/etc/passwd", ("catalogue",)),
    ("ROBOJACKSON_STORE", "s3://", METRICS),
    ("ROBOJACKSON_STORE", "evil://x/y", METRICS),
    ("ROBOJACKSON_STORE", "http://127.0.0.1:9/", METRICS),
    ("ROBOJACKSON_STORE", "/proc/store", ("dance", str(CLIP))),
    ("ROBOJACKSON_STORE", "x" * 300, ("dance", str(CLIP))),
    ("ROBOJACKSON_STORE", "a\x1bb", METRICS),
    ("ROBOJACKSON_CONFIGS", "/nothing", RETARGET),
    ("ROBOJACKSON_CONFIGS", "/etc/passwd", RETARGET),
    ("XDG_CACHE_HOME", "/etc/passwd", METRICS),
)


def cases() -> Iterator[Case]:
    for name, value, words in BAD:
        yield Case("environment", f"{name}={value[:40]!r}", words, env={name: value})
