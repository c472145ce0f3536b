"""What an IMC message is made of: the kinds of fields, and how a class declares them.

A message is a frozen dataclass whose annotations say how each field travels, in the order in which it travels. Nothing
here knows bytes; ``layout.py`` reads the annotations.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated, ClassVar, Final, TypeVar, dataclass_transform

NULL_MESSAGE: Final = 0xFFFF
"""Stands on the wire for an inline message that is not there."""


Made = TypeVar("Made")


@dataclass_transform(frozen_default=True)
def message(made: type[Made]) -> type[Made]:
    """Make a class a frozen dataclass that takes equality and text from ``Message``.

    Seventy classes with methods of their own each would cost a start a third of its time.
    """
    return dataclass(frozen=True, eq=False, repr=False)(made)


@message
class Message:
    """An IMC message without its header. Every field has a default, so that a maker names only what it means."""

    NUMBER: ClassVar[int] = NULL_MESSAGE
    """The message's id on the wire."""

    def _values(self) -> tuple[object, ...]:
        return tuple(getattr(self, field.name) for field in fields(self))

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and isinstance(other, Message) and other._values() == self._values()

    def __hash__(self) -> int:
        return hash((self.NUMBER, self._values()))

    def __repr__(self) -> str:
        told = ", ".join(f"{field.name}={getattr(self, field.name)!r}" for field in fields(self))
        return f"{type(self).__name__}({told})"


@message
class UnknownMessage(Message):
    """A message whose number the table does not have.

    Its length cannot be known, so ``rest`` is all that follows in the packet. Inside another message the fields behind it
    were not read and have their defaults.
    """

    number: int = NULL_MESSAGE
    rest: bytes = b""


@dataclass(frozen=True)
class Scalar:
    """A number of fixed size."""

    code: str
    """The ``struct`` module's letter."""


@dataclass(frozen=True)
class LongText:
    """UTF-8 behind a 16-bit length. Bytes that are no UTF-8 are kept as lone surrogates, so that nothing is lost."""


@dataclass(frozen=True)
class LongRaw:
    """Bytes behind a 16-bit length."""


@dataclass(frozen=True)
class OneMessage:
    """A message inside the message: its number, then its fields; 0xFFFF for none."""


@dataclass(frozen=True)
class ManyMessages:
    """A 16-bit count, then so many inline messages."""


Kind = Scalar | LongText | LongRaw | OneMessage | ManyMessages

U8 = Annotated[int, Scalar("B")]
I8 = Annotated[int, Scalar("b")]
U16 = Annotated[int, Scalar("H")]
I16 = Annotated[int, Scalar("h")]
U32 = Annotated[int, Scalar("I")]
I32 = Annotated[int, Scalar("i")]
F32 = Annotated[float, Scalar("f")]
F64 = Annotated[float, Scalar("d")]
Text = Annotated[str, LongText()]
Raw = Annotated[bytes, LongRaw()]
Inline = Annotated[Message | None, OneMessage()]
Item = TypeVar("Item", bound=Message)
ListOf = Annotated[tuple[Item, ...], ManyMessages()]
