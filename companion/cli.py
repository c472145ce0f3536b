"""The ``companion`` command: finds the sub-command's module, imports only that one, and keeps the exit statuses.

0 done, 1 failed, 2 wrong usage or configuration. Other packages add sub-commands by the entry-point group
``companion.commands`` (name = command, object = ``register``).
"""

from __future__ import annotations

import argparse
import codecs
import errno
import importlib
import io
import logging
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import entry_points, version
from typing import Any, Final

from .commands import MissingExtraError

COMMANDS: Final = {
    "run": ("companion.commands.run", "sail the real vessel"),
    "status": ("companion.commands.attach", "watch a running vessel, live"),
    "web": ("companion.web.command", "the page on the boat, for a telephone"),
    "check": ("companion.commands.check.command", "explain and validate a configuration"),
    "gateway": ("companion.commands.gateway", "the shore side of the LoRa link"),
    "imc": ("companion.commands.imc.command", "show and command the vessel in Neptus, over IMC"),
    "lora": ("companion.commands.lora", "configure a radio module"),
    "trial": ("companion.commands.trial.command", "a sea trial: the vessel measures itself"),
    "plan": ("companion.commands.plan.command", "make, check, upload, download and start plans"),
    "replay": ("companion.commands.replay", "run a recording again and compare"),
    "report": ("companion.commands.report", "HTML report of a run or a tlog"),
    "tune": ("companion.commands.tune", "design and check gains"),
    "keys": ("companion.commands.keys", "signing and radio keys"),
    "store": ("companion.commands.store", "export and import what the vessel keeps"),
    "depth": ("companion.commands.depth", "depth memory and charts: export, import, convert"),
    "explain": ("companion.commands.check.explain", "tables: failsafe conditions and more"),
    "bench-actuators": ("companion.commands.bench_actuators", "move the actuators on the bench"),
    "completion": ("companion.commands.completion", "print what a shell needs to complete words"),
}
GROUP: Final = "companion.commands"


_OF_THE_DISK: Final = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS)
"""What a writer meets that was not told its file's name by the computer."""


_PLAIN: Final = {"≥": ">=", "≤": "<=", "°": "deg", "→": "->", "…": "...", "–": "-", "×": "x", "µ": "u"}
"""What stands for a sign that a terminal's encoding does not have; a question mark for any other."""
_ERRORS: Final = "companion.plain"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit status."""
    _print_anything()
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        return _run(words)
    except KeyboardInterrupt:
        print("\ninterrupted", file=sys.stderr)
        return 130


def _print_anything() -> None:
    """A terminal that is not UTF-8 gets plainer signs: no command ends, its work done, for want of one."""
    codecs.register_error(_ERRORS, _plainer)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.encoding.lower().replace("-", "") != "utf8":
            stream.reconfigure(errors=_ERRORS)


def _plainer(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(_PLAIN.get(sign, "?") for sign in error.object[error.start : error.end]), error.end


def _run(words: Sequence[str]) -> int:
    # Loaded here, where Ctrl-C is waited for already: on a slow computer it takes a second.
    from .io.links import LinkConfigError
    from .settings import ConfigError

    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s", stream=sys.stderr)
    parser = _parser(words[0] if words else "")
    arguments = parser.parse_args(words, argparse.Namespace(whole_parser=whole_parser))
    if not hasattr(arguments, "run"):
        parser.print_help()
        return 2
    try:
        return int(arguments.run(arguments) or 0)
    except ConfigError as error:
        print(f"{error.source}: {len(error.mistakes)} mistake(s)", file=sys.stderr)
        for mistake in error.mistakes:
            print(f"  {mistake}", file=sys.stderr)
        return 2
    except (LinkConfigError, MissingExtraError) as error:
        print(error, file=sys.stderr)
        return 2
    except BrokenPipeError:
        return 1
    except OSError as error:
        print(_place(error, words[0]), file=sys.stderr)
        return 1


def _parser(word: str) -> argparse.ArgumentParser:
    """Build a parser that knows the wanted command in full and the others by one line each."""
    parser = argparse.ArgumentParser(prog="companion", description="Autopilot companion for small uncrewed boats.")
    parser.add_argument("--version", action=_Version, nargs=0, help="show the program's version")
    subparsers = parser.add_subparsers(metavar="COMMAND", title="commands")
    plugins = {} if word in COMMANDS else {point.name: point for point in entry_points(group=GROUP)}
    if word in COMMANDS:
        importlib.import_module(COMMANDS[word][0]).register(subparsers)
    elif word in plugins:
        _register(plugins[word].load(), subparsers)
    else:
        for name, (_, text) in COMMANDS.items():
            subparsers.add_parser(name, help=text)
        for point in plugins.values():
            _register(point.load(), subparsers)
    return parser


class _Version(argparse.Action):
    """Looks the version up only when it is asked for: the packages' metadata takes its time to read."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(f"companion {version('usv-companion')}")
        parser.exit()


def whole_parser() -> argparse.ArgumentParser:
    """A parser that knows every command in full."""
    parser = argparse.ArgumentParser(prog="companion")
    parser.add_argument("--version", action=_Version, nargs=0)
    subparsers = parser.add_subparsers()
    for module, _ in COMMANDS.values():
        importlib.import_module(module).register(subparsers)
    for point in entry_points(group=GROUP):
        _register(point.load(), subparsers)
    return parser


def _place(error: OSError, command: str) -> str:
    """What the computer refused, and what to do: a place is the user's to choose, so it is no fault of the program."""
    reason = error.strerror or str(error)
    if error.filename is None and error.errno in _OF_THE_DISK:
        return f"{reason}, while 'companion {command}' wrote; make room, or name another place, and begin again"
    if error.filename is None:
        return reason
    if isinstance(error, FileExistsError | NotADirectoryError):
        reason = "there is a file where a folder is wanted"
    return f"{error.filename}: {reason}; name another place, or see that this one is there and may be written"


def _register(register: Callable[[Any], None], subparsers: Any) -> None:
    register(subparsers)


if __name__ == "__main__":
    sys.exit(main())
