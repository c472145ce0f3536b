#!/usr/bin/env bash
# The one set-up step: a virtual environment with the locked packages. Safe to run again; runs no apt.
set -euo pipefail
venv=${1:-.venv}
lock=${2:-requirements.lock}
python=${PYTHON:-python3}

fail() { printf 'set-up stopped: %s\n' "$*" >&2; exit 1; }

command -v "$python" >/dev/null || fail "no $python here. Debian: apt install python3 python3-venv"
"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || fail "$("$python" --version) is too old; Python 3.11 or newer is needed"
"$python" -c 'import ensurepip, venv' 2>/dev/null || fail "the venv module is missing. Debian: apt install python3-venv"

start=$SECONDS
if [ ! -x "$venv/bin/python" ]; then
    echo "set-up 1/3: creating $venv with $("$python" --version | head -n 1)"
    "$python" -m venv "$venv" || fail "could not create $venv"
else
    echo "set-up 1/3: $venv is there"
fi
bar=off; [ -t 1 ] && bar=on
size=
[ "$lock" = requirements.lock ] && size=", some 1.8 GB on disk; a few minutes the first time"
echo "set-up 2/3: installing the locked packages ($(grep -c == "$lock")$size)"
"$venv/bin/python" -m pip install --disable-pip-version-check --progress-bar "$bar" --require-hashes -r "$lock" \
    | { grep -E --line-buffered '^(Collecting|Installing|Successfully)' || true; } \
    | awk '/^Collecting/ { n++; printf "  %d %s\n", n, $2; fflush(); next } { print "  " substr($0, 1, 60); fflush() }'
echo "set-up 3/3: installing this project"
"$venv/bin/python" -m pip install --disable-pip-version-check -q --no-build-isolation --no-deps -e .
touch "$venv/.ready"
echo "set-up done in $((SECONDS - start)) s"
