"""Variables that would break a library are refused before it loads, without their secrets."""

import pytest

from robojackson.cli.lifetime import variables
from robojackson.cli.lifetime.variables import check_environment
from robojackson.errors import BadConfiguration

BAD = {
    "MUJOCO_GL": "junk",
    "JAX_PLATFORMS": "cpu,evil",
    "XLA_FLAGS": "--evil",
    "OMP_NUM_THREADS": "0",
    "PREFECT_HOME": "/etc/passwd",
    "PREFECT_API_URL": "http://127.0.0.1:99999/api",
    "PREFECT_LOGGING_LEVEL": "LOUD",
    "ROBOJACKSON_CONFIGS": "/nothing",
    "XDG_CACHE_HOME": "/dev/null",
}
STORES = (
    "~/store",
    "file://~/store",
    "/dev/null",
    "/dev/null/x",
    "s3://",
    "evil://x",
    "/etc/passwd/x",
    "a\x1bb",
    "x" * 300,
)


@pytest.mark.parametrize("name", BAD)
def test_a_value_that_no_library_takes_is_named(name: str) -> None:
    with pytest.raises(BadConfiguration, match=f"^{name} is "):
        check_environment({name: BAD[name]})


@pytest.mark.parametrize("store", STORES)
def test_a_store_that_can_be_none_is_refused(store: str) -> None:
    with pytest.raises(BadConfiguration, match="ROBOJACKSON_STORE is "):
        check_environment({"ROBOJACKSON_STORE": store})


@pytest.mark.parametrize(
    "given",
    [
        {"MUJOCO_GL": "egl", "JAX_PLATFORMS": "cpu,cuda", "OMP_NUM_THREADS": "2,1"},
        {"ROBOJACKSON_STORE": "s3://robojackson/a", "XLA_FLAGS": "--xla_cpu_x=1 --xla_y"},
        {"XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"},
        {"ROBOJACKSON_STORE": "never/made", "PREFECT_API_URL": "https://[::1]:4200/api"},
        {"MUJOCO_GL": "", "ROBOJACKSON_STORE": "", "PREFECT_LOGGING_LEVEL": "debug"},
        {"ROBOJACKSON_STORE": "memory://x", "PREFECT_LOGGING_LEVEL": "10"},
    ],
)
def test_usual_values_pass(given: dict[str, str]) -> None:
    check_environment(given)


@pytest.mark.parametrize("name", ["MUJOCO_GL", "PYOPENGL_PLATFORM"])
def test_osmesa_without_its_library_is_named_with_what_to_do(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(variables, "_has_osmesa", lambda: False)
    with pytest.raises(BadConfiguration, match=f"^{name} is 'OSMesa': .*unset .*libosmesa6$"):
        check_environment({name: "OSMesa"})
    monkeypatch.setattr(variables, "_has_osmesa", lambda: True)
    check_environment({name: "osmesa"})


def test_a_password_in_an_address_is_not_shown() -> None:
    with pytest.raises(BadConfiguration) as refused:
        check_environment({"PREFECT_API_URL": "ftp://me:planted-secret@host/api"})
    assert "planted-secret" not in str(refused.value)
