"""The sub-commands of ``companion``: one module each, with ``register(subparsers)``; imported only when asked for."""


class MissingExtraError(Exception):
    """A command needs packages that are not installed; the text names the line that installs them."""


def install_line(extra: str) -> str:
    """How the packages of an extra are installed; the program is on no index, so from where it came."""
    return f"make setup (or pip install '.[{extra}]') in the checkout, or pip install 'PATH/TO/usv_companion-….whl[{extra}]'"
