"""Long work tells how far it is on a terminal, nothing in a pipe, and is interrupted with one line and no half file."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys

import pytest

from companion import cli
from companion.commands.progress import ProgressLine, recorded_s
from companion.io.whole_file import filled_folder, write_whole


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_how_far_how_fast_how_long_yet():
    now_s, out = [0.0], Terminal()
    with ProgressLine("simulating", 7200.0, out=out, clock_s=lambda: now_s[0]) as shown:
        shown.at(20.0)
        assert out.getvalue() == "", "what is done at once needs no progress"
        now_s[0] = 10.0
        shown.at(1800.0)
        said = out.getvalue()
        shown.at(1801.0)
        assert out.getvalue() == said, "not at each tick"
    assert "simulating  25%  30:00 of 2:00:00, 180 times real time, 0:30 left" in said
    assert out.getvalue().endswith("\r")


def test_nothing_in_a_pipe():
    now_s, out = [0.0], io.StringIO()
    with ProgressLine("replaying", None, out=out, clock_s=lambda: now_s[0]) as shown:
        now_s[0] = 10.0
        shown.at(100.0)
        shown.say("drawing ...")
    assert out.getvalue() == ""


def test_the_length_of_a_recorded_voyage_is_in_its_last_row(tmp_path):
    assert recorded_s(tmp_path) is None
    (tmp_path / "control.csv").write_text("t_s,a\n0.05,1\n312.4,2\n")
    assert recorded_s(tmp_path) == 312.4


def test_an_interrupted_write_leaves_the_file_that_was(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    path.write_text("before")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("pathlib.Path.write_bytes", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_whole(path, b"after")
    assert path.read_text() == "before"
    assert [item.name for item in tmp_path.iterdir()] == ["report.html"]


def test_a_link_is_followed_and_what_is_no_file_is_not_replaced(tmp_path):
    (tmp_path / "kept.html").write_text("before")
    (tmp_path / "link.html").symlink_to("kept.html")
    write_whole(tmp_path / "link.html", b"after")
    assert (tmp_path / "kept.html").read_bytes() == b"after"
    assert (tmp_path / "link.html").is_symlink()
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDWR)
    write_whole(tmp_path / "pipe", b"through")
    assert os.read(reader, 100) == b"through"
    os.close(reader)
    assert (tmp_path / "pipe").is_fifo()


def test_control_c_while_the_program_is_still_loading_gives_one_line(tmp_path):
    """As when it is pressed in the middle of an import: on a slow computer that lasts for seconds."""
    (tmp_path / "sitecustomize.py").write_text(
        "import sys\n"
        "class Pressed:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name in ('companion.settings', 'pydantic'):\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Pressed())\n"
    )
    code = "import sys; from companion.cli import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", code, "check"],
        env={"PYTHONPATH": f"{tmp_path}:."},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 130
    assert done.stderr == "\ninterrupted\n"


def test_what_is_counted_is_told_with_rate_and_rest():
    now_s, out = [0.0], Terminal()
    with ProgressLine("reading", None, out=out, clock_s=lambda: now_s[0]) as shown:
        now_s[0] = 4.0
        shown.count(12.0, 40.0, "MB")
        assert "reading 12.0 of 40.0 MB, 3.00 MB/s, 9 s left" in out.getvalue()


def test_control_c_gives_one_line(monkeypatch, capsys):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli, "_parser", interrupted)
    assert cli.main(["report", "x"]) == 130
    assert capsys.readouterr().err == "\ninterrupted\n"


def test_a_folder_that_stays_empty_goes_again_and_one_that_was_there_stays(tmp_path):
    (tmp_path / "old").mkdir()
    for name in ("new", "old"):
        with pytest.raises(OSError, match="space"), filled_folder(tmp_path / name):
            raise OSError(errno.ENOSPC, "No space left on device")
    with filled_folder(tmp_path / "filled"):
        (tmp_path / "filled" / "bode.png").write_bytes(b"x")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["filled", "old"]


def test_a_full_disk_without_a_files_name_is_told_with_the_command_and_the_mend(monkeypatch, capsys):
    def full(_arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("companion.commands.keys._check", full)
    assert cli.main(["keys", "check", "nowhere.key"]) == 1
    told = capsys.readouterr().err
    assert told.startswith("No space left on device, while 'companion keys' wrote; make room")
