"""README in a plain shell: what it types is found, what it opens has been made, and nothing names a package that is not ours."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from companion.cli import COMMANDS, main, whole_parser
from companion.commands.completion import script

REPO = Path(__file__).resolve().parents[2]
README = (REPO / "README.md").read_text(encoding="utf-8")
LINES = [line for block in re.findall(r"^```\n(.*?)^```", README, re.M | re.S) for line in block.splitlines() if line]


def test_programs_of_the_environment_come_after_the_line_that_makes_them_known():
    activated = next(number for number, line in enumerate(LINES) if line.startswith(". .venv/bin/activate"))
    first = next(number for number, line in enumerate(LINES) if re.match(r"(companion|mavproxy|python)", line))
    assert activated < first


def test_plan_files_are_made_before_they_are_used(tmp_path, monkeypatch):
    made = [line.split()[3] for line in LINES if line.startswith("companion plan make")]
    used = re.findall(r"(?:wp load|--plan) (\S+)", "\n".join(LINES))
    assert used
    assert set(used) <= set(made)
    monkeypatch.chdir(tmp_path)
    for line in LINES:
        if line.startswith("companion plan make"):
            assert main(line.split()[1:]) == 0


def test_nothing_names_a_package_of_an_index_that_is_not_ours():
    for path in [
        *REPO.glob("*.md"),
        *REPO.glob("docs/*.md"),
        *(REPO / "companion").rglob("*.py"),
        *(REPO / "sitl").rglob("*.py"),
    ]:
        assert "usv-companion[" not in path.read_text(encoding="utf-8"), path


def test_the_version_is_told(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert re.fullmatch(r"companion \d+\.\d+\.\d+\n", capsys.readouterr().out)


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ("", COMMANDS),
        ("plan", ("make", "upload", "start")),
        ("plan start", ("--far", "--url")),
        ("sim", ("--speed", "--plan")),
    ],
)
def test_a_shell_completes_commands_and_options(tmp_path, words, wanted):
    (tmp_path / "companion.bash").write_text(script("bash", whole_parser()))
    typed = ["companion", *words.split(), ""]
    ask = f"source companion.bash; COMP_WORDS=({' '.join(typed[:-1])} ''); COMP_CWORD={len(typed) - 1}; _companion; echo ${{COMPREPLY[@]}}"
    done = subprocess.run(["bash", "-c", ask], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert set(wanted) <= set(done.stdout.split())


def test_what_stands_beside_a_command_is_a_comment():
    """So that a whole line may be pasted into a shell."""
    for page in [*REPO.glob("*.md"), *REPO.glob("docs/*.md")]:
        for block in re.findall(r"^```\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S):
            for line in block.splitlines():
                if re.match(r"(\S*/)?companion |make |\.venv", line):
                    assert not re.search(r"\S {2,}[^ #]", line.partition("#")[0]), f"{page.name}: {line}"


def test_the_installer_is_a_shell_script_that_says_how_it_is_used():
    script = REPO / "config" / "system" / "install.sh"
    assert subprocess.run(["sh", "-n", script], check=False).returncode == 0
    done = subprocess.run(["sh", script], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "usage: sudo sh install.sh WHEEL" in done.stderr
