"""Who the vessel says it is on one endpoint: persona, identity, mode numbers, and what it needs to know of the vessel."""

from __future__ import annotations

from .config import Budget, EndpointConfig
from .port import Identity, ParamInfo, ParamTable, VehiclePort

__all__ = ["Budget", "EndpointConfig", "Identity", "ParamInfo", "ParamTable", "VehiclePort"]
