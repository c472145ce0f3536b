#!/usr/bin/env bash
# Print the PyPy to use, for Python 3.11 or newer: $PYPY and no other when it is set; else what tools/debian_pypy.sh fetched, or the system's.
set -euo pipefail
candidates=(.pypy/usr/bin/pypy3 pypy3.11 pypy3)
[ -z "${PYPY:-}" ] || candidates=("$PYPY")
for found in "${candidates[@]}"; do
    command -v "$found" >/dev/null || continue
    "$found" -c 'import sys; sys.exit(sys.implementation.name != "pypy" or sys.version_info < (3, 11))' 2>/dev/null || continue
    command -v "$found"
    exit
done
echo "no PyPy for Python 3.11 or newer here. Debian 13: apt install pypy3 pypy3-venv; Debian 12: tools/debian_pypy.sh;" >&2
echo "elsewhere unpack one and name it: make pypy PYPY=/its/bin/pypy3" >&2
exit 1
