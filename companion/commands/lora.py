"""``companion lora``: read a radio module's settings, bring them to a profile, change single ones, reset them, learn its codes.

Changes only what the profile names, verifies, and refuses models that it does not know. Runs on Windows too (COM5).
"""

from __future__ import annotations

import argparse
import errno
import os
import re
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from mavlink_bridge.radio.air import RadioProfile
from mavlink_bridge.radio.air.codes import ModuleCodes, read_codes
from mavlink_bridge.radio.air.module import ModuleError, differences, fields, wanted
from mavlink_bridge.radio.air.module_fields import NAMES, SettingError, changed, without_key

from ..io.links.radio_port import ModulePort
from ..radio import load_radio
from ..settings.device import no_device
from .outputs import may_write

_NOTHING: Final = "; nothing was written"
_NO_LINE: Final = "is no serial line; name the module's port, as /dev/ttyUSB0"


def register(subparsers: Any) -> None:
    """Add the command with its three actions."""
    parser = subparsers.add_parser("lora", help="configure a radio module", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    show = actions.add_parser("show", help="read model and settings; compare with a profile")
    apply = actions.add_parser("apply", help="bring the settings to a profile")
    reset = actions.add_parser("reset", help="factory settings")
    change = actions.add_parser("set", help="change single settings: channel=21 power=6 key_file=module.key")
    change.add_argument("settings", nargs="+", metavar="NAME=VALUE", help=f"of {', '.join((*NAMES, 'rate'))}")
    learn = actions.add_parser(
        "bench", help="write down what the vendor's tool shows, or you measured: rate=656 mhz=868.92"
    )
    learn.add_argument(
        "facts", nargs="+", metavar="NAME=VALUE", help="rate in bit/s, mhz; of the settings that the module has now"
    )
    for action in (show, change, learn):
        action.add_argument("--codes", type=Path, default=Path("radio-codes.toml"), help="the file of what was learned")
    apply.add_argument("profile", help="name of a file in config/radio, or a path")
    show.add_argument("--profile", help="say what differs from this profile")
    for action in (show, apply):
        action.add_argument("--side", choices=("vessel", "shore"), default="vessel", help="whose NODE ID")
    for action, function in ((show, _show), (apply, _apply), (change, _set), (learn, _bench), (reset, _reset)):
        action.add_argument("port", help="/dev/ttyUSB0, COM5, ...")
        action.add_argument(
            "--set-by", default="hand", metavar="HOW", help="how SET goes low: hand, rts, dtr, gpio:N, sim or none"
        )
        action.set_defaults(run=_guarded, action=function)


def _guarded(arguments: argparse.Namespace) -> int:
    try:
        return int(arguments.action(arguments))
    except SettingError as error:
        print(f"companion lora: {error}", file=sys.stderr)
        return 2
    except ModuleError as error:
        print(f"companion lora: {_plain(str(error), arguments.port)}", file=sys.stderr)
        return 1


def _plain(text: str, port: str) -> str:
    """A module's complaint; of a port that cannot be opened the reason alone, which the library tells twice with its number."""
    numbers = re.findall(r"(?:\[Errno |\()(\d+)(?:\]|, ')", text)
    if not numbers:
        return text
    number = int(numbers[-1])
    return f"{port}: {_NO_LINE if number == errno.ENOTTY else os.strerror(number)}"


def _open(arguments: argparse.Namespace) -> ModulePort:
    return ModulePort(arguments.port, arguments.set_by)


def _show(arguments: argparse.Namespace) -> int:
    profile = load_radio(arguments.profile) if arguments.profile else None
    with _open(arguments) as port:
        print(f"Model and version: {port.model()}")
        block = port.block()
    for field in fields(block, _codes(arguments.codes)):
        print(f"  {field.name:13} {field.shown}")
    print(f"  raw           {without_key(block).hex()} (the key's bytes as zeros)")
    if profile is None:
        return 0
    _explain(profile)
    found = differences(block, wanted(profile, arguments.side, block))
    for line in found:
        print(f"  differs: {line}")
    return 1 if found else 0


def _apply(arguments: argparse.Namespace) -> int:
    profile = load_radio(arguments.profile)
    _explain(profile)
    with _open(arguments) as port:
        print(f"Model and version: {port.model()}")
        block = port.block()
        new = wanted(profile, arguments.side, block)
        changes = differences(block, new)
        for line in changes:
            print(f"  {line}")
        if new != block:
            port.write(new)
    print(f"{len(changes)} settings changed and read back" if changes else "nothing to change")
    return 0


def _set(arguments: argparse.Namespace) -> int:
    with _open(arguments) as port:
        print(f"Model and version: {port.model()}")
        block = port.block()
        new = block
        for word in arguments.settings:
            name, equals, value = word.partition("=")
            if not equals:
                raise SettingError(f"{word!r}: give NAME=VALUE; nothing was written")
            if name == "rate":
                name, value = "rate_index", _rate_index(value, arguments.codes)
            new = changed(new, name, value, _key)
        changes = differences(block, new)
        for line in changes:
            print(f"  {line}")
        if new != block:
            port.write(new)
    print(f"{len(changes)} settings changed and read back" if changes else "nothing to change")
    return 0


def _bench(arguments: argparse.Namespace) -> int:
    """Change nothing of the module; write down what its present settings are found to mean."""
    codes = _codes(arguments.codes)
    may_write(arguments.codes, is_own=_are_codes)
    with _open(arguments) as port:
        print(f"Model and version: {port.model()}")
        block = port.block()
    for word in arguments.facts:
        name, _, value = word.partition("=")
        codes = codes.learned(block, name, value)
    arguments.codes.write_text(codes.as_toml(), encoding="utf-8")
    known = ", ".join(str(index) for index in sorted(codes.rates)) or "none"
    print(f"written to {arguments.codes}; air rates are known of index {known}")
    return 0


def _are_codes(tables: Mapping[str, Any]) -> bool:
    """Whether a file holds what was learned, and nothing else."""
    return tables.keys() <= {"rates", "mhz"}


def _codes(path: Path) -> ModuleCodes:
    """What was learned; nothing where there is no file."""
    try:
        return read_codes(tomllib.loads(no_device(path).read_text(encoding="utf-8")))
    except FileNotFoundError:
        return ModuleCodes()
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ModuleError(f"{path}: {error}") from None


def _rate_index(value: str, path: Path) -> str:
    """The index of an air rate that was learned."""
    index = _codes(path).index_of(int(value)) if value.isascii() and value.isdigit() else None
    if index is None:
        raise SettingError(
            f"rate = {value}: its index is not known; 'companion lora bench rate={value} PORT' writes it down"
        )
    return str(index)


def _key(path: str) -> bytes:
    """The bytes of a key file that nobody else may read."""
    file = Path(path)
    try:
        if file.stat().st_mode & 0o077 and hasattr(file.stat(), "st_blocks"):
            raise ModuleError(f"key_file = {path}: others may read it; chmod 600 {path}; nothing was written")
        return no_device(file).read_bytes()
    except OSError as error:
        raise ModuleError(f"key_file = {path}: {error.strerror}; nothing was written") from None


def _reset(arguments: argparse.Namespace) -> int:
    with _open(arguments) as port:
        print(f"Model and version: {port.model()}")
        port.block()  # a module whose settings could not be told afterwards is left alone
        port.reset()
        try:
            block = port.block()
        except ModuleError as error:
            raise ModuleError(f"the module took the factory reset; {str(error).removesuffix(_NOTHING)}") from None
    print(f"factory settings: {block.hex()}")
    return 0


def _explain(profile: RadioProfile) -> None:
    print(
        f"{profile.title}: {profile.frequency_mhz:g} MHz, {profile.erp_dbm:.1f} dBm e.r.p., {profile.band_rule.title}"
    )
    if profile.attenuation_db > 0:
        print(
            f"  needs {profile.attenuation_db:g} dB between module and antenna; without it this power level is not allowed"
        )
    if not profile.frequency_measured:
        print("  the frequency of this channel is inferred; check it in the vendor's tool")
