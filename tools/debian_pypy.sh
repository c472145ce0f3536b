#!/usr/bin/env bash
# PyPy 3.11 for a Debian or Raspberry Pi OS 12, whose own is too old: Debian 13's packages, unpacked into a folder together with the
# C library that they want. Installs nothing in the system, and needs no rights there.
set -euo pipefail
folder=${1:-.pypy}
suite=trixie
keys=/usr/share/keyrings/debian-archive-keyring.gpg

fail() { printf 'no PyPy: %s\n' "$*" >&2; exit 1; }

command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null || fail "this is no Debian; unpack a PyPy 3.11 and name it: PYPY=/its/bin/pypy3"
[ -r "$keys" ] || fail "$keys is missing. Debian: apt install debian-archive-keyring"
own=$(sed -n 's/^VERSION_CODENAME=//p' /etc/os-release)
mirror=$(apt-get --print-uris update 2>/dev/null | sed -n "s|^'\(.*/debian\)/dists/$own/InRelease'.*|\1|p" | sed -n 1p)
[ -n "$mirror" ] || fail "apt knows no Debian mirror here"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/lists/partial" "$work/archives/partial" "$work/parts"
: >"$work/status"
echo "deb [signed-by=$keys] $mirror $suite main" >"$work/sources.list"
apt() {
    apt-get -qq -o Dir::Etc::SourceList="$work/sources.list" -o Dir::Etc::SourceParts="$work/parts" -o Dir::State="$work" \
        -o Dir::State::Lists="$work/lists" -o Dir::State::status="$work/status" -o Dir::Cache="$work" \
        -o Dir::Cache::Archives="$work/archives" -o APT::Sandbox::User="$(id -un)" -o Debug::NoLocking=1 "$@"
}
echo "fetching Debian 13's PyPy (some 60 MB)"
apt update
apt install -y --no-install-recommends --download-only pypy3 pypy3-venv patchelf >/dev/null

rm -rf "$folder" && mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
for package in "$work"/archives/*.deb; do dpkg-deb -x "$package" "$folder"; done
libraries=$(dirname "$(ls -d "$folder"/usr/lib/*/libc.so.6)")
loader=$(ls "$libraries"/ld-linux-*.so.*)
# an RPATH of the program holds for all that it loads later, as its modules' libraries are
"$loader" --library-path "$libraries" "$folder/usr/bin/patchelf" \
    --set-interpreter "$loader" --force-rpath --set-rpath "$libraries" "$folder/usr/bin/pypy3.11"
"$folder/usr/bin/pypy3" -c 'import ssl, sqlite3, sys; print("PyPy for Python", sys.version.split()[0], "in", sys.prefix)'
