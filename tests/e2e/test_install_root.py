"""The installer in a clean Debian root, as on a Raspberry Pi: the first time, again, and against what it must leave alone."""

from __future__ import annotations

import pytest

from tests.e2e.clean_root import CleanRoot, wheel

pytestmark = [pytest.mark.e2e, pytest.mark.soak]
UNPACK = "cd /root && python3 -m zipfile -e usv_companion-*.whl usv"
INSTALL = f"{UNPACK} && sh usv/config/system/install.sh usv_companion-*.whl"
CHECK = (
    "cd /var/lib/usv-companion && runuser -u usv -- /opt/usv-companion/bin/companion check /etc/usv-companion/boat.toml"
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return wheel(tmp_path_factory.mktemp("wheel"))


def computer(folder, made, *packages):
    root = CleanRoot(folder, ("python3-venv", *packages, "udev"))
    root.put(made, f"/root/{made.name}")
    return root


@pytest.fixture
def pi(tmp_path, made):
    return computer(tmp_path, made)


def test_the_first_time(pi):
    said = pi.run(INSTALL)
    assert "is in force" in said
    assert "systemctl start usv-companion" in said
    facts = pi.run(
        "id -nG usv; stat -c '%U:%G %a' /etc/usv-companion /etc/usv-companion/boat.toml /var/lib/usv-companion; du -sm /opt/usv-companion/"
    ).splitlines()
    assert set(facts[0].split()) >= {"usv", "dialout"}
    assert facts[1:4] == ["root:usv 750", "root:usv 640", "usv:usv 750"]
    assert int(facts[4].split()[0]) < 250
    assert "good" in pi.run(CHECK)
    assert pi.path("/etc/systemd/system/usv-companion.service").is_file()
    assert pi.path("/etc/udev/rules.d/60-usv-companion.rules").is_file()


def test_the_vessel_runs_as_its_user_and_writes_only_where_it_may(pi):
    pi.run(INSTALL)
    start = CHECK.replace("companion check", "companion run")
    said = pi.run(f"{start} --duration 4; find /var/lib/usv-companion -type f -not -user usv")
    assert "root" not in said.splitlines()[-1]
    assert pi.path("/var/lib/usv-companion/state/companion.db").is_file()
    assert list(pi.path("/var/lib/usv-companion/runs").glob("*/control.csv"))


def test_an_upgrade_keeps_settings_stores_and_the_program_before(pi):
    pi.run(INSTALL)
    pi.run(
        "sed -i s/my-boat/gull/ /etc/usv-companion/boat.toml; echo '# mine' >> /etc/udev/rules.d/60-usv-companion.rules"
    )
    pi.run(f"{CHECK.replace('companion check', 'companion run')} --duration 2")
    said = pi.run(INSTALL)
    assert "gull" in pi.path("/etc/usv-companion/boat.toml").read_text()
    assert pi.path("/etc/udev/rules.d/60-usv-companion.rules").read_text().endswith("# mine\n")
    assert pi.path("/etc/udev/rules.d/60-usv-companion.rules.new").is_file()
    (kept,) = pi.path("/var/lib/usv-companion/state").glob("before-*/companion.db")
    assert kept.stat().st_size > 0
    names = pi.run("readlink /opt/usv-companion; ls -d /opt/usv-companion-*").split()
    assert names[0].endswith(".2")
    assert len(names) == 3, "the new one and the one before"
    assert "before it" in said
    pi.run(f"ln -sfn {names[1]} /opt/usv-companion")
    assert "gull" in pi.run(CHECK), "going back"


def test_a_file_that_the_new_program_does_not_take_leaves_the_old_one_in_force(pi):
    pi.run(INSTALL)
    before = pi.run("readlink /opt/usv-companion")
    pi.run("echo 'nonsense = 1' | cat - /etc/usv-companion/boat.toml > /tmp/x; cp /tmp/x /etc/usv-companion/boat.toml")
    said = pi.run(INSTALL, ends=1)
    assert "nonsense" in said
    assert "the old one stays" in said
    assert pi.run("readlink /opt/usv-companion; ls -d /opt/usv-companion-*").split() == [before.strip()] * 2


def test_the_first_releases_folder_is_kept(pi):
    pi.run("mkdir -p /opt/usv-companion/bin; echo old > /opt/usv-companion/bin/companion")
    pi.run(INSTALL)
    assert pi.run("cat /opt/usv-companion-before/bin/companion") == "old\n"
    assert pi.run("/opt/usv-companion/bin/companion --version").startswith("companion ")


@pytest.mark.parametrize("umask", ["027", "077"])
def test_a_strict_umask_makes_no_program_that_its_user_cannot_run(pi, umask):
    assert "is in force" in pi.run(f"umask {umask}; {INSTALL}")
    assert "good" in pi.run(CHECK)


def test_a_program_that_its_user_cannot_reach_is_told_as_that(pi):
    pi.run("chmod 700 /opt")
    said = pi.run(INSTALL, ends=1)
    assert "the user usv cannot run" in said
    assert "does not take" not in said
    assert pi.run("ls /opt") == ""


def test_the_program_before_stays_whatever_form_its_link_has(pi):
    """A relative link, as 'cd /opt; ln -sfn usv-companion-OLD usv-companion' makes it: the one before was deleted."""
    pi.run(INSTALL)
    before = pi.run(
        "cd /opt; name=$(basename $(readlink usv-companion)); ln -sfn $name usv-companion; echo $name"
    ).strip()
    assert f"before it: /opt/{before} " in pi.run(INSTALL)
    assert pi.run(f"/opt/{before}/bin/companion --version").startswith("companion ")


SYSTEMCTL = """#!/bin/sh
echo "$*" >> /root/asked
[ "$1" != is-active ] || { echo STATE; [ STATE = active ]; }
"""


def under_systemd(pi, state):
    """A service manager that takes every word, for a service in this state."""
    pi.run("mkdir -p /run/systemd/system")
    pi.run(f"cat > /usr/bin/systemctl <<'END'\n{SYSTEMCTL.replace('STATE', state)}END\nchmod +x /usr/bin/systemctl")


def test_a_service_between_two_starts_is_one_that_runs(pi):
    """A program that ends and is started again was upgraded without --stop, or not, as it happened."""
    under_systemd(pi, "activating")
    assert "the boat's service is running" in pi.run(INSTALL, ends=1)


def test_a_full_partition_of_the_state_leaves_all_as_it_was(pi):
    """It had stopped the service, left half a store under the name of its copy, and said nothing of either."""
    pi.run(INSTALL)
    before = pi.run("readlink -f /opt/usv-companion; ls /opt")
    under_systemd(pi, "active")
    full = (
        "d=/var/lib/usv-companion; mount -t tmpfs -o size=2m tmpfs $d; install -d -o usv -g usv $d/state; "
        "head -c 1500000 /dev/zero > $d/state/companion.db; chown usv: $d $d/state/companion.db"
    )
    said = pi.run(f"{full}; ({INSTALL} --stop); echo ended $?; ls /var/lib/usv-companion/state")
    assert "install stopped: the stores could not be copied" in said
    assert said.split()[-3:] == ["ended", "1", "companion.db"]
    assert pi.run("readlink -f /opt/usv-companion; ls /opt") == before
    assert pi.path("/root/asked").read_text().split("\n")[-3:] == ["stop usv-companion", "start usv-companion", ""]


@pytest.mark.parametrize(
    ("words", "ends", "told"),
    [
        ("", 2, "usage"),
        ("nowhere.whl", 1, "no such file"),
        ("/etc/passwd", 1, "no wheel"),
        ("usv_companion-*.whl --wheels /nowhere", 1, "no such folder"),
        ("usv_companion-*.whl --wheels /tmp", 1, "nothing is changed"),
    ],
)
def test_what_is_wrong_is_told_and_nothing_is_changed(pi, words, ends, told):
    assert told in pi.run(f"{UNPACK} && sh usv/config/system/install.sh {words}", ends=ends)
    assert pi.run("ls /opt; getent passwd usv || true") == ""


def test_systemd_finds_no_fault_in_the_unit(tmp_path, made):
    """With the program where the unit looks for it, and the targets that it names."""
    pi = computer(tmp_path, made, "systemd")
    pi.run(INSTALL)
    assert pi.beside(["systemd-analyze", "verify", f"--root={pi.root}", "usv-companion.service"]) == ""
