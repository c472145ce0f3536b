"""IMC, the wire protocol of LSTS' consoles and vehicles: messages, bytes, and the life of a system among others."""

from .fields import NULL_MESSAGE as NULL_MESSAGE, Message as Message, UnknownMessage as UnknownMessage
from .layout import MalformedError as MalformedError, kinds_of as kinds_of
from .messages import *  # noqa: F403 - the table's messages and the numbers of their fields
from .messages import TABLE as TABLE
from .names import holds_unknown as holds_unknown, name_of as name_of
from .node import Node as Node, NodeConfig as NodeConfig, Position as Position
from .packet import (
    ANNOUNCED as ANNOUNCED,
    BROADCAST as BROADCAST,
    ENTITY_SYSTEM as ENTITY_SYSTEM,
    ENTITY_UNKNOWN as ENTITY_UNKNOWN,
    NOBODY as NOBODY,
    Header as Header,
    Packet as Packet,
    PacketCounters as PacketCounters,
    PacketReader as PacketReader,
    decode as decode,
    encode as encode,
    fields_bytes as fields_bytes,
    parse_fields as parse_fields,
)
from .system import (
    Asker as Asker,
    Destination as Destination,
    Discovery as Discovery,
    Outgoing as Outgoing,
    Place as Place,
    SystemPart as SystemPart,
    Tcp as Tcp,
    Udp as Udp,
)
