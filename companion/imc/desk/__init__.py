"""What a console may ask of the vessel: plans kept and sailed, sticks, limits, parameters, and who commands."""

from ..desk_config import DeskConfig
from .desk import Desk
from .entities import parameter_file

__all__ = ["Desk", "DeskConfig", "parameter_file"]
