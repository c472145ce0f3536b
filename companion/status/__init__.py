"""What somebody who watches is told of the vessel: the picture, the words of now and next, the socket that serves them, orders that stop.

The vessel's process serves one local socket; a terminal and the page on the boat hang on it. Nobody who watches is a ground station.
"""

from .picture import Picture, picture_of

__all__ = ["Picture", "picture_of"]
