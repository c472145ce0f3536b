"""``companion keys``: make, check and hand over the keys of signed links and of the radio."""

from __future__ import annotations

import argparse
import base64
import getpass
import os
import shlex
import sys
from pathlib import Path
from typing import Any

from ..io.keeping.keys import (
    KEY_BYTES,
    KeyFileError,
    fingerprint,
    from_passphrase,
    new_page_passphrase,
    page_key_from_passphrase,
    radio_key_from_passphrase,
    read_key,
    write_key,
)
from .outputs import may_write


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser("keys", help="signing and radio keys", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    make = actions.add_parser("make", help="make a new random key, readable by its owner only")
    make.add_argument("file", type=Path)
    make.add_argument("--passphrase", action="store_true", help="from a passphrase, as ground stations do (asked for)")
    make.add_argument(
        "--radio",
        action="store_true",
        help="with --passphrase: a key for the radio, made so that guessing costs memory",
    )
    make.add_argument(
        "--page",
        action="store_true",
        help="a key for the page's Hold and Disarm, with the words that open it on a telephone",
    )
    make.add_argument("--replace", action="store_true", help="overwrite a key; the other side then needs the new one")
    make.set_defaults(run=_make)
    check = actions.add_parser("check", help="say whether key files are good, with fingerprints to compare")
    check.add_argument("file", type=Path, nargs="+")
    check.set_defaults(run=_check)
    show = actions.add_parser("show", help="print the key itself, for the other side")
    show.add_argument("file", type=Path)
    show.add_argument("--form", choices=("hex", "base64"), default="hex")
    show.set_defaults(run=_show)


def _make(arguments: argparse.Namespace) -> int:
    folder = arguments.file.parent
    if not folder.is_dir():  # a slip in a path would make a tree of folders that nobody looks into
        print(f"{arguments.file}: no such folder; make it first: mkdir -p {shlex.quote(str(folder))}", file=sys.stderr)
        return 2
    if arguments.replace:
        may_write(arguments.file)
    if arguments.page:
        return _make_page(arguments)
    try:
        key = _passphrase_key(radio=arguments.radio) if arguments.passphrase else os.urandom(KEY_BYTES)
        write_key(arguments.file, key, replace=arguments.replace)
    except KeyFileError as error:
        print(error, file=sys.stderr)
        return 1 if isinstance(error.__cause__, OSError) else 2
    print(f"{arguments.file}: made, fingerprint {fingerprint(key)}")
    if arguments.passphrase:
        print("a key for the radio" if arguments.radio else "a key for MAVLink signing; for the radio add --radio")
    print("copy it to the other side by a way that you trust; its fingerprint there must be the same")
    return 0


def _make_page(arguments: argparse.Namespace) -> int:
    """A key of words: one's own with --passphrase, else new ones, which are printed once and kept nowhere."""
    try:
        words = _asked_words() if arguments.passphrase else new_page_passphrase()
        key = page_key_from_passphrase(words)
        write_key(arguments.file, key, replace=arguments.replace)
    except KeyFileError as error:
        print(error, file=sys.stderr)
        return 1 if isinstance(error.__cause__, OSError) else 2
    print(f"{arguments.file}: made, fingerprint {fingerprint(key)}")
    if not arguments.passphrase:
        print(f"what to type on the page: {words}")
    print(f'in the boat\'s file: [page] key_file = "{arguments.file}"')
    return 0


def _passphrase_key(*, radio: bool) -> bytes:
    words = _asked_words()
    return radio_key_from_passphrase(words) if radio else from_passphrase(words)


def _asked_words() -> str:
    words = getpass.getpass("passphrase: ") if sys.stdin.isatty() else sys.stdin.readline().rstrip("\n")
    if len(words) < 12:
        raise KeyFileError("a passphrase of fewer than 12 characters can be guessed; take a longer one")
    return words


def _check(arguments: argparse.Namespace) -> int:
    status = 0
    for path in arguments.file:
        try:
            print(f"{path}: good, fingerprint {fingerprint(read_key(path))}")
        except KeyFileError as error:
            print(error, file=sys.stderr)
            status = 2
    return status


def _show(arguments: argparse.Namespace) -> int:
    try:
        key = read_key(arguments.file)
    except KeyFileError as error:
        print(error, file=sys.stderr)
        return 2
    print(key.hex() if arguments.form == "hex" else base64.b64encode(key).decode())
    return 0
