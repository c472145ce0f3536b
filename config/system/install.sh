#!/bin/sh
# Installs the vessel on a Raspberry Pi (Debian 12 or newer), or upgrades it, from one wheel. Safe to run again.
# What it does, step by step, and how to go back: docs/RASPBERRY.md.
set -eu
umask 022  # whoever calls it, and however strictly: what is made here is for another user to run

usage() {
    echo "usage: sudo sh install.sh WHEEL [--wheels FOLDER] [--stop]"
    echo "  --wheels FOLDER   take the packages from there: a boat without internet"
    echo "  --stop            stop the running service for the upgrade: only when the boat is moored and disarmed"
}
say() { echo "install: $*"; }
fail() { told=yes; echo "install stopped: $*" >&2; exit 1; }

here=$(cd "$(dirname "$0")" && pwd)
wheel=
wheels=
stop=
while [ $# -gt 0 ]; do
    case $1 in
        --wheels) [ $# -gt 1 ] || { usage >&2; exit 2; }; wheels=$2; shift ;;
        --stop) stop=yes ;;
        -h | --help) usage; exit 0 ;;
        -*) usage >&2; exit 2 ;;
        *) wheel=$1 ;;
    esac
    shift
done
[ -n "$wheel" ] || { usage >&2; exit 2; }
[ -f "$wheel" ] || fail "$wheel: no such file"
case $wheel in *usv_companion-*.whl) ;; *) fail "$wheel is no wheel of this program" ;; esac
[ -z "$wheels" ] || [ -d "$wheels" ] || fail "$wheels: no such folder"
[ "$(id -u)" -eq 0 ] || fail "run it as root: sudo sh $0 $wheel"

user=usv
settings=/etc/usv-companion
state=/var/lib/usv-companion
link=/opt/usv-companion
units=/etc/systemd/system
rules=/etc/udev/rules.d
service=usv-companion
systemd() { [ -d /run/systemd/system ]; }
service_runs() {
    systemd || return
    case $(systemctl is-active "$service" || true) in
        active | activating | reloading | deactivating) ;;  # "activating" also between two starts of a program that fails
        *) return 1 ;;
    esac
}
may_stop() {
    [ -n "$stop" ] || ! service_runs ||
        fail "the boat's service is running, and an upgrade stops it: moor and disarm, then run this again with --stop"
}
as_user() { runuser -u "$user" -- "$@"; }

# However this ends before its end: what is half made goes, and a service that was stopped for it runs again.
told=
place=
copy=
beside=
aside=
in_force=
stopped=
is_in_force() { [ -n "$place" ] && [ "$(readlink -f "$link")" = "$(readlink -f "$place")" ]; }
leave() {
    [ "$?" -ne 0 ] || return 0
    trap '' INT TERM HUP  # a second Ctrl-C would leave half of this undone
    ! is_in_force || in_force=yes  # or the program would be removed that the service is to start
    [ -n "$in_force" ] || [ -z "$aside" ] || [ -e "$link" ] || mv -T "$aside" "$link" || say "bring it back: mv -T $aside $link"
    [ -z "$beside" ] || rm -f "$beside" || true  # what cannot be removed is told, and the service comes all the same
    [ -n "$told" ] || echo "install stopped: see above${in_force:+; the new program is in force, what comes after is not done: run this again}" >&2
    [ -n "$in_force" ] || rm -rf ${place:+"$place"} ${copy:+"$copy"} || true
    [ -z "$stopped" ] || systemctl start "$service" || say "start it: systemctl start $service"
}
trap leave EXIT
trap 'fail "interrupted; nothing is changed"' INT TERM HUP

# 1. Is this the machine for it, and does nobody sail on it?
command -v python3 >/dev/null || fail "no python3 here: apt install python3 python3-venv"
python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || fail "$(python3 --version) is too old: Debian 12 or newer is needed"
if ! python3 -c 'import ensurepip' 2>/dev/null; then
    say "installing python3-venv"
    apt-get install -y -q python3-venv >/dev/null || fail "python3-venv is missing and could not be installed"
fi
may_stop

# 2. The program, in a folder of its own: the one before stays until this one has shown that it runs.
version=$(basename "$wheel" | cut -d- -f2)
free=$link-$version
number=2
while [ -e "$free" ]; do free=$link-$version.$number; number=$((number + 1)); done
place=$free
say "installing $version into $place"
python3 -m venv "$place" || fail "could not create $place"
from=
[ -z "$wheels" ] || from="--no-index --find-links $wheels"
install_packages() {
    # shellcheck disable=SC2086  # two words
    "$place/bin/pip" install --disable-pip-version-check -q --no-deps --require-hashes $from -r "$here/requirements.lock" || return
    "$place/bin/pip" install --disable-pip-version-check -q --no-deps --no-index "$wheel"
}
install_packages || fail "the packages could not be installed (above); nothing is changed"
trial=$(mktemp -d)
"$place/bin/companion" sim --speed max --duration 1 --run-dir "$trial/run" >/dev/null ||
    { rm -rf "$trial"; fail "a simulation of one second failed (above); nothing is changed"; }
rm -rf "$trial"

# 3. Who it runs as, where it keeps what. What is there stays as it is.
getent passwd "$user" >/dev/null || {
    say "adding the user $user"
    useradd --system --user-group --no-create-home --home-dir "$state" --shell /usr/sbin/nologin "$user"
}
for group in dialout gpio; do
    ! getent group "$group" >/dev/null || usermod -aG "$group" "$user"
done
install -d -o root -g "$user" -m 0750 "$settings"
install -d -o "$user" -g "$user" -m 0750 "$state"
first=
if [ ! -e "$settings/boat.toml" ]; then
    first=yes
    shipped=$("$place/bin/python" -c 'import config; print(config.path("boat.toml"))')
    install -o root -g "$user" -m 0640 "$shipped" "$settings/boat.toml"
fi

# 4. Can that user run the new program, and does it understand the boat's file? If not, the old one stays in force.
(cd "$state" && as_user "$place/bin/companion" --version >/dev/null) ||
    fail "the user $user cannot run $place/bin/companion (above): 'chmod a+rx' the folders that lead there. Nothing is changed"
checked=yes
(cd "$state" && as_user "$place/bin/companion" check "$settings/boat.toml") || checked=
if [ -z "$checked" ] && [ -e "$link" ]; then
    fail "the new program does not take $settings/boat.toml (above); the old one stays. Mend a copy, see docs/UPGRADING.md"
fi

# 5. The stores as the old one left them are kept beside, whole or not at all. Then the new one is in force.
may_stop  # somebody may have set sail while the packages came
if service_runs; then stopped=yes; systemctl stop "$service"; fi
before=
if [ -L "$link" ]; then before=$(readlink -f "$link" || true); elif [ -e "$link" ]; then
    before=$link-before
    number=2
    while [ -e "$before" ]; do before=$link-before.$number; number=$((number + 1)); done
fi
if [ -n "$before" ] && ls "$state"/state/*.db >/dev/null 2>&1; then
    kept=$state/state/before-$(basename "$place")
    copy=$kept.new
    rm -rf "$copy"
    { install -d -o "$user" -g "$user" -m 0750 "$copy" && cp -p "$state"/state/*.db* "$copy/"; } ||
        fail "the stores could not be copied to $kept (above): make room there. Nothing is changed"
    rm -rf "$kept"
    mv "$copy" "$kept"
    say "the stores as they were: $kept"
fi
beside=$link.new
ln -sfT "$place" "$beside" || fail "$beside could not be made (above). Nothing is changed"
trap '' INT TERM HUP  # or one of them comes when the program is in force and this does not know it yet
if [ -e "$link" ] && [ ! -L "$link" ]; then
    aside=$before
    mv -T "$link" "$before" || fail "$link could not be moved to $before (above). Nothing is changed"
fi
mv -T "$beside" "$link" || is_in_force || fail "$link could not be made (above). Nothing is changed"
in_force=yes
trap 'fail "interrupted; the new program is in force, what comes after is not done: run this again"' INT TERM HUP
for old in "$link"-[0-9]*; do
    [ "$old" = "$place" ] || [ "$(readlink -f "$old")" = "$before" ] || rm -rf "$old"
done

# 6. Service and device names. What somebody has changed is left, or kept beside.
install -d "$units" "$rules"
for unit in "$here"/*.service; do
    there=$units/$(basename "$unit")
    if [ -e "$there" ] && ! cmp -s "$unit" "$there"; then
        cp -p "$there" "$there.before"
        say "$there is replaced; yours is $there.before (changes belong into 'systemctl edit $(basename "$unit" .service)')"
    fi
    install -m 0644 "$unit" "$there"
done
for rule in "$here"/*.rules; do
    there=$rules/$(basename "$rule")
    if [ -e "$there" ] && ! cmp -s "$rule" "$there"; then
        install -m 0644 "$rule" "$there.new"
        say "$there stays as it is; the shipped one is $there.new"
    else
        install -m 0644 "$rule" "$there"
    fi
done
if systemd; then
    systemctl daemon-reload
    if ! { udevadm control --reload && udevadm trigger --subsystem-match=tty; }; then say "device names come with the next start"; fi
    systemctl enable -q "$service"
    [ -z "$stopped" ] || systemctl start "$service"
    systemctl is-active --quiet ModemManager && say "ModemManager talks to serial devices: apt purge modemmanager"
else
    say "no systemd runs here: the service is installed, not enabled"
fi

# 7. What to do now.
say "$("$link/bin/companion" --version) is in force${before:+; before it: $before (to go back: docs/UPGRADING.md)}"
if [ -n "$first" ]; then
    say "next: put your devices into $rules/60-usv-companion.rules and $settings/boat.toml, then"
    say "  $link/bin/companion check $settings/boat.toml"
    say "  systemctl start $service"
elif [ -z "$stopped" ]; then
    say "next: systemctl start $service"
fi
