"""``companion completion``: what a shell needs to complete commands, actions and options; made from the parsers themselves."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any, Final

_BASH: Final = """\
_companion() {{
    local words=" ${{COMP_WORDS[*]:1:COMP_CWORD-1}} " current="${{COMP_WORDS[COMP_CWORD]}}" options
    case "$words" in
{cases}
    esac
    COMPREPLY=($(compgen -W "$options" -- "$current") $(compgen -f -- "$current"))
}}
complete -o filenames -F _companion companion
"""
_ZSH: Final = "autoload -U +X bashcompinit && bashcompinit\n" + _BASH
SHELLS: Final = {"bash": _BASH, "zsh": _ZSH}


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("completion", help="print what a shell needs to complete words", description=__doc__)
    parser.add_argument("shell", choices=SHELLS, help='then: eval "$(companion completion bash)"')
    parser.set_defaults(run=command)


def command(arguments: argparse.Namespace) -> int:
    """Print the script. ``whole_parser`` comes from the program itself, which alone knows all commands."""
    print(script(arguments.shell, arguments.whole_parser()), end="")
    return 0


def script(shell: str, parser: argparse.ArgumentParser) -> str:
    """Return the completion of a parser with all its sub-commands."""
    cases = [f'        *" {way} "*) options="{" ".join(words)}" ;;' for way, words in reversed(list(_ways(parser)))]
    return SHELLS[shell].format(cases="\n".join(cases).replace('*" " "*)', "*)").replace('*"  "*)', "*)"))


def _ways(parser: argparse.ArgumentParser, way: str = "") -> Iterator[tuple[str, list[str]]]:
    """Each parser with the words that lead to it, and what may be typed there; inner ones behind outer ones."""
    inner = _inner(parser)
    options = sorted(
        option for action in parser._actions for option in action.option_strings if option.startswith("--")
    )
    yield way, [*inner, *options]
    for name, found in inner.items():
        yield from _ways(found, f"{way} {name}".strip())


def _inner(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    actions = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    return dict(actions[0].choices) if actions else {}
