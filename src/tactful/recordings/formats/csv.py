"""Tables in text: comma, semicolon, tab or blanks between the cells, with or without a header, also gzipped."""

from __future__ import annotations

import csv
import io
import re
import zlib
from collections.abc import Sequence
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
    notes = list(head.notes)
    try:
        values = np.loadtxt(
            io.StringIO(text[head.body :]), delimiter=head.delimiter, comments=None, ndmin=2, dtype=np.float64
        )
        plain = values.shape[0] > 0 and values.shape[1] == len(head.names)
    except ValueError:
        plain = False
    if plain:
        if not text.endswith("\n"):
            notes.append("the last line has no line end: its last number may be cut")
        index = {name: i for i, name in enumerate(head.names)}
        return Table(
            path=path,
            format="csv",
            names=head.names,
            rows=len(values),
            load=lambda name: values[:, index[name]],
            load_text=lambda name: [f"{value:g}" for value in values[:, index[name]]],
            header=head.header,
            notes=tuple(notes),
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
        notes=(*notes, *cells.notes),
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
    """What the first lines say of the rest."""

    names: tuple[str, ...]
    header: bool
    delimiter: str | None
    body: int
    first_line: int
    notes: tuple[str, ...]
    decimal_comma: bool

    @classmethod
    def of(cls, text: str, path: Path) -> _Head:
        start, number, comment = 0, 1, None
        while True:
            end = text.find("\n", start)
            end = len(text) if end < 0 else end
            line = text[start:end]
            if line.strip() and not line.lstrip().startswith("#"):
                break
            comment = line.lstrip().lstrip("#") if line.strip() else comment
            start, number = end + 1, number + 1
            if start >= len(text):
                raise RecordingError("there are comments but no rows", path=path)
        delimiter = next((mark for mark in (";", "\t", ",") if mark in line), None)
        cells = _split(line, delimiter)
        notes: list[str] = []
        header = not all(_number(cell) or not cell for cell in cells)
        decimal_comma = False
        if not header and delimiter in (";", "\t", None):
            decimal_comma = "," in line
        elif header and delimiter in (";", "\t"):
            decimal_comma = "," in text[end : text.find("\n", end + 1) % (len(text) + 1)]
        if header and delimiter is not None and any(_number(cell.replace(",", ".")) for cell in cells):
            loose = [cell for cell in cells if not _number(cell.replace(",", "."))]
            if not loose:
                header, decimal_comma = False, True
        if header:
            names = cells
            start, number = min(end + 1, len(text)), number + 1
        elif comment is not None and len(_split(comment, delimiter)) == len(cells):
            names, header = _split(comment, delimiter), True
        else:
            names = [str(i) for i in range(len(cells))]
        if header and names and names[-1] == "":
            names = names[:-1]
        if header and "" in names:
            raise RecordingError(
                f"column {names.index('')} has no name in the header: name every column", path=path, line=number - 1,
                column=names.index(""),
            )
        if not text[start:].strip():
            raise RecordingError("there is a header but no rows: the logger wrote nothing after it", path=path)
        if decimal_comma:
            notes.append("decimal commas read as points")
        return cls(tuple(names), header, delimiter, start, number, tuple(notes), decimal_comma)


@dataclass(frozen=True)
class _Cells:
    """The cells of a table that is not plain numbers: some empty, some text, some torn."""

    path: Path
    names: tuple[str, ...]
    columns: list[list[str]]
    lines: list[int]
    notes: tuple[str, ...]

    @classmethod
    def of(cls, text: str, head: _Head, path: Path) -> _Cells:
        body = text[head.body :]
        if head.decimal_comma:
            body = body.replace(",", ".")
        if head.delimiter is None:
            body = re.sub(r"[ \t]+", " ", body)
        reader = csv.reader(
            (line.strip(" ") for line in body.split("\n")), delimiter=head.delimiter or " ", skipinitialspace=True
        )
        width = len(head.names)
        rows: list[list[str]] = []
        lines: list[int] = []
        torn: tuple[int, int] | None = None
        notes: list[str] = []
        try:
            for row in reader:
                line = head.first_line + reader.line_num - 1
                if not any(cell.strip() for cell in row) and len(row) <= 1:
                    continue
                if torn is not None:
                    raise RecordingError(
                        f"{torn[1]} cells, but there are {width} columns: mend or remove the line", path=path, line=torn[0]
                    )
                if len(row) == width + 1 and not row[-1].strip():
                    row.pop()
                if len(row) != width:
                    torn = (line, len(row))
                    continue
                rows.append(row)
                lines.append(line)
        except csv.Error as error:
            raise RecordingError(f"{error}", path=path, line=head.first_line + reader.line_num - 1) from None
        if torn is not None:
            if torn[1] > width or not rows:
                raise RecordingError(
                    f"{torn[1]} cells, but there are {width} columns: mend or remove the line", path=path, line=torn[0]
                )
            notes.append(f"line {torn[0]}, the last one, is torn ({torn[1]} of {width} cells): dropped")
        elif not text.endswith("\n") and len(rows) > 1:
            if _number(rows[-2][-1]) and not _number(rows[-1][-1]):
                notes.append(f"line {lines[-1]}, the last one, is torn in its last cell: dropped")
                rows.pop()
                lines.pop()
            else:
                notes.append("the last line has no line end: its last number may be cut")
        columns = [[cell.strip() for cell in column] for column in zip(*rows, strict=True)]
        return cls(path, head.names, columns, lines, tuple(notes))

    def column(self, name: str) -> Sequence[str]:
        return self.columns[self.names.index(name)]

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


def _split(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]


def _number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
