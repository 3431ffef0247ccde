"""Tables in text: comma, semicolon, tab or blanks between the cells, with or without a header, also gzipped."""

from __future__ import annotations

import csv
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tactful.recordings._errors import RecordingError
from tactful.recordings._table import Table

if TYPE_CHECKING:
    from tactful.recordings._recording import Recording

SUFFIX = ".csv"
NO_LINE_END = "the last line has no line end: its last number may be cut"


def matches(head: bytes) -> bool:
    """Whatever nothing else claims is taken for text; what is none says so when it is opened."""
    return True


def open_table(path: Path) -> Table:
    """Columns of a text table; a torn last line is dropped and noted.

    Raises:
        RecordingError: no text, no rows, a line with another number of cells, two columns of one name.
    """
    text = _text(path)
    head = _Head.of(text, path)
    try:
        values = np.loadtxt(_lines(text, head.body), delimiter=head.delimiter, comments=None, ndmin=2, dtype=np.float64)
        plain = values.shape[0] > 0 and values.shape[1] == len(head.names)
    except ValueError:
        plain = False
    if plain:
        index = {name: i for i, name in enumerate(head.names)}
        return Table(
            path=path,
            format="csv",
            names=head.names,
            rows=len(values),
            load=lambda name: values[:, index[name]],
            load_text=lambda name: [f"{value:g}" for value in values[:, index[name]].tolist()],
            header=head.header,
            notes=() if text.endswith("\n") else (NO_LINE_END,),
        )
    cells = _Cells.of(text, head, path)
    return Table(
        path=path,
        format="csv",
        names=head.names,
        rows=len(cells.lines),
        load=cells.numbers,
        load_text=cells.column,
        header=head.header,
        notes=tuple(cells.notes),
    )


def save(recording: Recording, path: Path) -> None:
    """Write `time` and the channels, a column each, with as many digits as read back bit for bit."""
    names = ["time"]
    for name, values in recording.channels.items():
        names += [f"{name}_{i}" for i in range(values.shape[1])]
    columns = [recording.t, *(column for values in recording.channels.values() for column in values.T)]
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(names) + "\n")
        for start in range(0, len(recording), 10_000):
            block = [column[start : start + 10_000].tolist() for column in columns]
            file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*block, strict=True))


def _text(path: Path) -> str:
    data = path.read_bytes()
    if data[:2] == b"\x1f\x8b":
        try:
            data = zlib.decompress(data, wbits=31)
        except zlib.error as error:
            raise RecordingError(f"the gzip stream is torn ({error}): compress the file again", path=path) from None
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = data.count(b"\n", 0, error.start) + 1
            raise RecordingError(
                f"byte {error.start} is no text: expected CSV, Parquet, NPZ or JSON", path=path, line=line
            ) from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise RecordingError("a zero byte: this is no text; expected CSV, Parquet, NPZ or JSON", path=path, line=line)
    if not text.strip():
        raise RecordingError("the file is empty", path=path)
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text


@dataclass(frozen=True)
class _Head:
    """What the first lines say of the rest: `body` is where the rows begin, in line `first_line`."""

    names: tuple[str, ...]
    header: bool
    delimiter: str | None
    body: int
    first_line: int
    decimal_comma: bool

    @classmethod
    def of(cls, text: str, path: Path) -> _Head:
        start, number, comment = 0, 1, ""
        while True:
            end = text.find("\n", start)
            end = len(text) if end < 0 else end
            line = text[start:end].strip()
            if line and not line.startswith("#"):
                break
            comment = line.lstrip("#") or comment
            start, number = end + 1, number + 1
            if start >= len(text):
                raise RecordingError("there are comments but no rows", path=path)
        delimiter = next((mark for mark in (";", "\t", ",") if mark in line), None)
        decimal_comma = delimiter != "," and "," in text[start:]
        cells = _split(line, delimiter, path, number)
        header = not all(not cell or _number(cell.replace(",", ".") if decimal_comma else cell) for cell in cells)
        if header:
            start, number = end + 1, number + 1
            if not text[start:].strip():
                raise RecordingError("there is a header but no rows: the logger wrote nothing after it", path=path)
        elif len(names := _split(comment.replace('"', ""), delimiter, path, number)) == len(cells):
            header, cells = True, names
        else:
            cells = [str(i) for i in range(len(cells))]
        if cells[-1] == "":
            cells.pop()
        if "" in cells:
            place = cells.index("")
            raise RecordingError(f"column {place}, counted from 0, has no name in the header", path=path, column=place)
        return cls(tuple(cells), header, delimiter, start, number, decimal_comma)


@dataclass(frozen=True)
class _Cells:
    """The cells of a table that is not plain numbers: some empty, some text, some torn."""

    path: Path
    names: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    notes: list[str]

    @classmethod
    def of(cls, text: str, head: _Head, path: Path) -> _Cells:
        body = text[head.body :].replace(",", ".") if head.decimal_comma else text[head.body :]
        cells = cls(path, head.names, [], [], ["decimal commas read as points"] if head.decimal_comma else [])
        torn = None
        for line, content in enumerate(body.split("\n"), head.first_line):
            if not content.strip():
                continue
            if torn is not None:
                raise torn
            row = _split(content, head.delimiter, path, line)
            if len(row) == len(head.names) + 1 and not row[-1]:
                row.pop()
            if len(row) == len(head.names):
                cells.rows.append(row)
                cells.lines.append(line)
                continue
            torn = RecordingError(
                f"{len(row)} cells, but there are {len(head.names)} columns: mend or remove the line",
                path=path,
                line=line,
            )
            if len(row) > len(head.names) or not cells.rows:
                raise torn
        if torn is not None:
            cells.notes.append(f"line {torn.line}, the last one, is torn: dropped")
        elif not text.endswith("\n"):
            cells._end_of_torn_text()
        return cells

    def _end_of_torn_text(self) -> None:
        """A last line without a line end may break off within a number."""
        if len(self.rows) > 1 and _number(self.rows[-2][-1]) and not _number(self.rows[-1][-1]):
            self.notes.append(f"line {self.lines[-1]}, the last one, is torn: dropped")
            self.rows.pop()
            self.lines.pop()
        else:
            self.notes.append(NO_LINE_END)

    def column(self, name: str) -> Sequence[str]:
        place = self.names.index(name)
        return [row[place] for row in self.rows]

    def numbers(self, name: str) -> NDArray[np.float64]:
        cells = self.column(name)
        values = np.empty(len(cells))
        for i, cell in enumerate(cells):
            try:
                values[i] = float(cell) if cell else np.nan
            except ValueError:
                raise RecordingError(
                    f"column {name!r} holds {cell!r:.40}, which is no number: write nan where there is none",
                    path=self.path,
                    line=self.lines[i],
                    column=name,
                ) from None
        return values


def _lines(text: str, start: int) -> Iterator[str]:
    while (end := text.find("\n", start)) >= 0:
        yield text[start:end]
        start = end + 1
    yield text[start:]


def _split(line: str, delimiter: str | None, path: Path, number: int) -> list[str]:
    if '"' in line:
        try:
            cells = next(csv.reader([line], delimiter=delimiter or " ", skipinitialspace=True, strict=True), [])
        except csv.Error as error:
            raise RecordingError(f"a quoted cell does not end: {error}", path=path, line=number) from None
    else:
        cells = line.split(delimiter)
    return [cell.strip() for cell in cells]


def _number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
