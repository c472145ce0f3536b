#!/usr/bin/env bash
# The one set-up step: a virtual environment with the packages of one lock file. Safe to run again; runs no apt.
# The lean set is a part of the whole one, of the same versions, so that each may follow the other in one environment.
set -euo pipefail
venv=${1:-.venv}
lock=${2:-requirements.lock}
ready=$venv/${3:-.ready}
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
case $lock in
    requirements.lock) size=", some 930 MB on disk; a few minutes the first time" ;;
    config/system/requirements.lock) size=", some 140 MB on disk; half a minute the first time" ;;
    *) size= ;;
esac
# Of the lean set only what a simulation loads is compiled ahead (below): all of it would be 90 MB and half of the time more.
compile=--compile; [ "$lock" = config/system/requirements.lock ] && compile=--no-compile
echo "set-up 2/3: installing the locked packages ($(grep -E == "$lock" | grep -vc "'none'")$size)"
# The lock is complete, and leaves out what a package asks for only for its windows: nothing beyond it is looked up.
"$venv/bin/python" -m pip install --disable-pip-version-check --progress-bar "$bar" --no-deps "$compile" --require-hashes -r "$lock" \
    | { grep -E --line-buffered '^(Collecting|Installing|Successfully)' || true; } \
    | awk '/^Collecting/ { n++; printf "  %d %s\n", n, $2; fflush(); next } { print "  " substr($0, 1, 60); fflush() }'
echo "set-up 3/3: installing this project"
"$venv/bin/python" -m pip install --disable-pip-version-check -q --no-build-isolation --no-deps -e .
if [ "$lock" = config/system/requirements.lock ]; then
    trial=$(mktemp -d)
    env -u PYTHONDONTWRITEBYTECODE "$venv/bin/companion" sim --speed max --duration 1 --run-dir "$trial/run" >/dev/null \
        || fail "a simulation of one second failed (above)"
    rm -r "$trial"
fi
touch "$ready" "$venv/.lean"
echo "set-up done in $((SECONDS - start)) s"
