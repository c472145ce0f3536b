"""Where each key of a TOML file stands: its line, so that a mistake can be pointed at. For text that is valid TOML already."""

from __future__ import annotations

from typing import Final

Key = tuple[str | int, ...]
"""A key's way down from the top, positions in lists counted from 0."""

_CLOSES: Final = {"[": "]", "{": "}"}


def lines_of(text: str) -> dict[Key, int]:
    """Return the line (from 1) of every table and key, those in inline tables and lists of them included."""
    return _Scanner(text).scan()


class _Scanner:
    """Goes through the text once. What is not understood is passed over: a line number is a help, never a condition."""

    def __init__(self, text: str) -> None:
        self._text = text + "\n"
        self._at = 0
        self._line = 1
        self._found: dict[Key, int] = {}
        self._counts: dict[Key, int] = {}

    def scan(self) -> dict[Key, int]:
        table: Key = ()
        while self._at < len(self._text):
            self._blank(newlines=True)
            if self._at >= len(self._text):
                break
            if self._text[self._at] == "[":
                table = self._header()
            else:
                self._pair(table)
            self._rest_of_line()
        return self._found

    def _header(self) -> Key:
        many = self._text.startswith("[[", self._at)
        self._step(2 if many else 1)
        key = self._inside(self._key())
        if many:
            number = self._counts.get(key, -1) + 1
            self._counts[key] = number
            self._found.setdefault(key, self._line)
            key = (*key, number)
        for length in range(1, len(key) + 1):
            self._found.setdefault(key[:length], self._line)
        return key

    def _inside(self, key: Key) -> Key:
        """A header below a list of tables belongs to the newest of them."""
        way: Key = ()
        for part in key[:-1]:
            way = (*way, part)
            if way in self._counts:
                way = (*way, self._counts[way])
        return (*way, *key[-1:])

    def _pair(self, table: Key) -> None:
        line = self._line
        key = (*table, *self._key())
        for length in range(len(table) + 1, len(key) + 1):
            self._found.setdefault(key[:length], line)
        self._blank()
        if self._peek() == "=":
            self._step()
            self._value(key)

    def _key(self) -> Key:
        parts: list[str] = []
        while True:
            self._blank()
            if self._peek() in "\"'":
                parts.append(self._string())
            else:
                begin = self._at
                while self._peek().isalnum() or self._peek() in "_-":
                    self._step()
                parts.append(self._text[begin : self._at])
            self._blank()
            if self._peek() != ".":
                return tuple(parts)
            self._step()

    def _value(self, key: Key) -> None:
        self._blank()
        start = self._peek()
        if start in "\"'":
            self._string()
        elif start in _CLOSES:
            self._items(key, _CLOSES[start])
        else:
            while self._peek() not in ",]}#\n":
                self._step()

    def _items(self, key: Key, close: str) -> None:
        """The items of a list or of an inline table."""
        self._step()
        number = 0
        while True:
            self._blank(newlines=True)
            if self._at >= len(self._text) - 1:
                return
            if self._peek() == close:
                self._step()
                return
            before = self._at
            if close == "}":
                self._pair(key)
            else:
                self._found.setdefault((*key, number), self._line)
                self._value((*key, number))
                number += 1
            self._blank(newlines=True)
            if self._peek() == "," or self._at == before:
                self._step()

    def _string(self) -> str:
        quote = self._peek()
        mark = quote * 3 if self._text.startswith(quote * 3, self._at) else quote
        self._step(len(mark))
        begin = self._at
        while self._at < len(self._text) - 1 and not self._text.startswith(mark, self._at):
            self._step(2 if quote == '"' and self._peek() == "\\" else 1)
        end = self._at
        self._step(len(mark))
        while len(mark) == 3 and self._peek() == quote:
            self._step()
        return self._text[begin:end]

    def _blank(self, *, newlines: bool = False) -> None:
        while self._at < len(self._text):
            letter = self._text[self._at]
            if letter == "#":
                while self._peek() != "\n":
                    self._step()
            elif letter in " \t\r" or (newlines and letter == "\n"):
                self._step()
            else:
                return

    def _rest_of_line(self) -> None:
        while self._at < len(self._text) and self._text[self._at] != "\n":
            self._step()

    def _peek(self) -> str:
        return self._text[self._at] if self._at < len(self._text) else "\n"

    def _step(self, count: int = 1) -> None:
        self._line += self._text.count("\n", self._at, self._at + count)
        self._at += count
