"""The sub-commands of ``companion``: one module each, with ``register(subparsers)``; imported only when asked for."""


class MissingExtraError(Exception):
    """A command needs packages that are not installed; the text names the line that installs them."""
