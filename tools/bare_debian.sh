#!/bin/sh
# README's two commands on a bare Debian: debootstrap makes a system of the smallest variant in a folder, the
# tracked and new files of this checkout are copied in, and what `bootstrap.sh missing` names is installed.
#   tools/bare_debian.sh bookworm|trixie [FOLDER]     needs root and debootstrap; prints the seconds of each step
# Environment: DANCE (arguments of `make dance`; empty: none), TESTS (the target; empty: none), MIRROR, BIND
# (folders and files that the machine's pip needs and that shall be seen inside, such as a local index), and what begins
# with PIP_, SSL_ or TORCH_, which is handed in. Certificates that this machine trusts besides Debian's are trusted
# inside. FOLDER stays; a system that is in it already is used again.
set -eu
SUITE=${1:?usage: bare_debian.sh bookworm|trixie [FOLDER]}
FOLDER=${2:-$(mktemp -d)/$SUITE}
case $FOLDER in /*) ;; *) FOLDER=$PWD/$FOLDER ;; esac # of the folder where the command was given
cd "$(dirname "$0")/.."
MIRROR=${MIRROR:-http://deb.debian.org/debian}
DANCE=${DANCE---minutes 4}
TESTS=${TESTS-test-fast}

mounted=
leave() {
    for place in $mounted; do
        umount "$FOLDER$place" 2>/dev/null || umount -l "$FOLDER$place" || true
    done
}
trap leave EXIT
trap 'exit 130' INT TERM

mount_in() { # the source, the place inside
    if [ -d "$1" ]; then mkdir -p "$FOLDER$2"; else mkdir -p "$FOLDER$(dirname "$2")" && : >>"$FOLDER$2"; fi
    mount --bind "$1" "$FOLDER$2"
    mounted="$2 $mounted"
}

inside() {
    handed=$(env | sed -n 's/^\(\(PIP\|SSL\|TORCH\)_[A-Z_]*\)=.*/\1/p')
    set -- sh -c "cd /robojackson && $1"
    for name in $handed; do # a value may have spaces: two indexes are one PIP_EXTRA_INDEX_URL
        set -- "$name=$(printenv "$name")" "$@"
    done
    set -- PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive "$@"
    chroot "$FOLDER" env -i "$@"
}

step() { # a name, a command inside
    began=$(date +%s)
    if inside "$2"; then code=0; else code=$?; fi
    echo "bare $SUITE: $1: exit code $code, $(($(date +%s) - began)) s"
    [ "$code" = 0 ] || exit "$code"
}

began=$(date +%s)
[ -e "$FOLDER/etc/debian_version" ] || debootstrap --variant=minbase "$SUITE" "$FOLDER" "$MIRROR" >&2
echo "bare $SUITE: Debian $(cat "$FOLDER/etc/debian_version"): $(($(date +%s) - began)) s"

mkdir -p "$FOLDER/robojackson"
git ls-files -z --cached --others --exclude-standard | xargs -0 ls -d 2>/dev/null |
    tar -cf - -T - | tar -xf - -C "$FOLDER/robojackson"
cp /etc/resolv.conf "$FOLDER/etc/resolv.conf"
for place in /proc /sys /dev /dev/pts /dev/shm ${BIND:-}; do
    mount_in "$place" "$place"
done

trust() {
    ls /usr/local/share/ca-certificates/*.crt >/dev/null 2>&1 || return 0
    mkdir -p "$FOLDER/usr/local/share/ca-certificates"
    cp /usr/local/share/ca-certificates/*.crt "$FOLDER/usr/local/share/ca-certificates/"
    step "certificates" "apt-get update -qq && apt-get install -y -qq --no-install-recommends ca-certificates >/dev/null &&
        update-ca-certificates >/dev/null"
}

trust
step "apt-get update, make" "apt-get update -qq && apt-get install -y -qq --no-install-recommends make >/dev/null"
echo "bare $SUITE: lacks: $(inside "sh tools/bootstrap.sh missing")"
inside "make setup" || true # names what is missing, in one sentence
step "what was named" 'apt-get install -y -qq --no-install-recommends $(sh tools/bootstrap.sh missing) >/dev/null'
echo "bare $SUITE: lacks: $(inside "sh tools/bootstrap.sh missing")."
step "set up" "make setup"
[ -z "$DANCE" ] || step "make dance ARGS='$DANCE'" "make dance ARGS='$DANCE'"
[ -z "$TESTS" ] || step "make $TESTS" "make $TESTS"
inside ".venv/bin/python --version; du -sh .venv | cut -f1"
