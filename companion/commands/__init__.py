"""The sub-commands of ``companion``: one module each, with ``register(subparsers)``; imported only when asked for."""
