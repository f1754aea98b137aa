#!/bin/sh
# What `make` runs first. POSIX sh, nothing of ours installed.
#   bootstrap.sh missing   print the apt packages that this machine lacks, on one line
#   bootstrap.sh check     one sentence and exit 1 when something is lacking, before any work
#   bootstrap.sh install   create .venv or update it; does nothing when it is
#   bootstrap.sh dependencies   create .venv with all that RoboJackson needs and without RoboJackson: what the
#                          image is built with reads pyproject.toml and constraints.txt alone
# Environment: PYTHON (an interpreter 3.11, 3.12 or 3.13; by default the first of these that is here
# and can make an environment), TORCH_INDEX (where torch comes from), EXTRAS (which of pyproject.toml's
# optional dependencies; the image leaves `dev` out).
set -eu
cd "$(dirname "$0")/.."
VENV=.venv
STAMP=$VENV/.stamp
EXTRAS=${EXTRAS:-app,fast,s3,dev}
CUDA="4.7 GB of it for CUDA, which nothing here uses, where pip's index has no other build; 0.8 GB with \
TORCH_INDEX=ADDRESS, the address of PyTorch's wheels for CPUs"
LEAST_GB=6 # a new environment: 5.2 with torch's CPU build, 8.5 with the one for CUDA

OURS='(3, 11) <= sys.version_info[:2] <= (3, 13)'
is_python() { "$1" -c "import sys; sys.exit(not $OURS)" 2>/dev/null; }
has_venv() { "$1" -c 'import venv, ensurepip' 2>/dev/null; }
version() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])'; }

candidates() {
    for minor in 11 12 13; do
        echo "python3.$minor /usr/bin/python3.$minor"
    done
    echo "python3 /usr/bin/python3"
}

# The interpreter: the first that can make an environment if there is any, else the first of ours.
find_python() {
    found=
    if [ -n "${PYTHON:-}" ]; then # a path, which may have spaces
        is_python "$PYTHON" && found=$PYTHON
        echo "$found"
        return
    fi
    for name in $(candidates); do
        is_python "$name" || continue
        [ -n "$found" ] || found=$name
        if has_venv "$name"; then
            found=$name
            break
        fi
    done
    echo "$found"
}

libraries() { { ldconfig -p || /sbin/ldconfig -p; } 2>/dev/null; }

has_mesa() {
    for file in /usr/lib/*/dri/*_dri.so /usr/lib/dri/*_dri.so /usr/lib64/dri/*_dri.so; do
        [ -e "$file" ] && return 0
    done
    return 1
}

missing() {
    packages=
    python=$(find_python)
    if [ -z "$python" ] && command -v python3 >/dev/null; then
        packages="python3.11 python3.11-venv" # the python3 of this system is none of ours
    elif [ -z "$python" ]; then
        packages="python3 python3-venv"
    elif ! has_venv "$python"; then
        packages="python$(version "$python")-venv"
    fi
    known=$(libraries)
    for pair in libEGL.so.1:libegl1 libGLESv2.so.2:libgles2 libOpenGL.so.0:libopengl0; do
        case $known in *"${pair%%:*}"*) ;; *) packages="$packages ${pair#*:}" ;; esac
    done
    has_mesa || packages="$packages libgl1-mesa-dri"
    echo $packages
}

check() {
    if [ -n "${PYTHON:-}" ] && ! is_python "$PYTHON"; then
        echo "PYTHON=$PYTHON is no Python 3.11, 3.12 or 3.13; name one of these, or leave PYTHON out." >&2
        exit 1
    fi
    packages=$(missing)
    [ -z "$packages" ] && return 0
    echo "This machine lacks system packages that RoboJackson needs; install them with:" \
        "apt-get install --no-install-recommends $packages" >&2
    exit 1
}

expected() { { cat pyproject.toml constraints.txt tools/bootstrap.sh; echo "${TORCH_INDEX:-} $EXTRAS"; } | cksum; }

pinned() { sed -n "s/^$1==//p" constraints.txt; }

say() { echo "setup: $*" >&2; }

# Refuse a disk that a new environment would fill.
require_room() {
    free=$(df -Pk . | awk 'NR == 2 { print int($4 / 1048576) }')
    [ "${free:-$LEAST_GB}" -ge "$LEAST_GB" ] && return 0
    say "$VENV takes 5 to 9 GB of disk and $free GB are free here; make room, or work on another disk"
    exit 1
}

# Whether the environment is there with pip (an interrupted first `make` leaves one without), of a Python of ours
# and of PYTHON's version where that is given.
has_environment() {
    is_python "$VENV/bin/python" || return 1
    "$VENV/bin/python" -c 'import pip' 2>/dev/null || return 1
    [ -z "${PYTHON:-}" ] || [ "$(version "$PYTHON")" = "$(version "$VENV/bin/python")" ]
}

# The requirements of pyproject.toml with those of EXTRAS, one a line.
requirements() {
    "$VENV/bin/python" - "$EXTRAS" <<'END'
import sys, tomllib
with open("pyproject.toml", "rb") as file:
    project = tomllib.load(file)["project"]
optional = project["optional-dependencies"]
for group in (project["dependencies"], *(optional[name] for name in sys.argv[1].split(","))):
    print(*group, sep="\n")
END
}

environment() {
    has_environment && return 0
    require_room
    python=$(find_python)
    say "creating $VENV with Python $(version "$python")"
    rm -rf "$VENV"
    "$python" -m venv "$VENV"
}

# Install torch, what is given to pip, pinned, and one build of OpenCV.
fill() {
    pip="$VENV/bin/python -m pip --disable-pip-version-check --quiet"
    say "torch $(pinned torch) (some minutes$([ -n "${TORCH_INDEX:-}" ] || echo "; $CUDA"))"
    # First and alone: later packages would install a CUDA build of several gigabytes.
    $pip install ${TORCH_INDEX:+--index-url "$TORCH_INDEX"} "torch==$(pinned torch)"
    say "the rest"
    $pip install --constraint constraints.txt "$@"
    # MediaPipe and scenedetect install two more OpenCV builds; all three share one folder, and the
    # one with windows needs libraries that a server has not.
    say "headless OpenCV alone"
    $pip uninstall --yes opencv-python opencv-contrib-python
    $pip install --no-deps --force-reinstall \
        "opencv-python-headless==$(pinned opencv-python-headless)"
}

dependencies() {
    check
    environment
    requirements >"$VENV/requirements.txt"
    fill --requirement "$VENV/requirements.txt"
    say "done, without RoboJackson itself"
}

install() {
    check
    if [ -f "$STAMP" ] && [ "$(cat "$STAMP")" = "$(expected)" ] && has_environment; then
        return 0
    fi
    environment
    fill --editable ".[$EXTRAS]"
    expected >"$STAMP"
    say "done"
}

case ${1:-} in
missing | check | install | dependencies) "$1" ;;
*)
    echo "usage: bootstrap.sh missing|check|install|dependencies" >&2
    exit 2
    ;;
esac
