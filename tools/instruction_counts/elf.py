"""As much of a 32-bit little-endian ELF file as an emulator needs: what to load where, and the names."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ARM, RISCV = 40, 243  #: e_machine
_WRITE, _ALLOC, _EXECUTE = 1, 2, 4  #: sh_flags
_NOBITS, _SYMTAB = 8, 2  #: sh_type
_FUNCTION = 2  #: type of a symbol, low four bits of st_info


@dataclass(frozen=True)
class Section:
    """A section that lies in memory."""

    name: str
    address: int
    size: int
    data: bytes  #: empty where the section is zeros (.bss)
    writable: bool
    executable: bool


@dataclass(frozen=True)
class Symbol:
    """A function or variable; `address` without the Thumb bit."""

    name: str
    address: int
    size: int
    is_function: bool
    is_global: bool


class Elf:
    """A linked program or one object file.

    machine: ARM or RISCV. sections: those that lie in memory. symbols: by name. undefined: names of functions and
    variables that another file must provide.
    Raises ValueError for anything that is not a 32-bit little-endian ELF file.
    """

    def __init__(self, path: Path):
        self.path = Path(path)
        data = self.path.read_bytes()
        if data[:6] != b"\x7fELF\x01\x01":
            raise ValueError(f"{path}: not a 32-bit little-endian ELF file")
        self.machine = struct.unpack_from("<H", data, 18)[0]
        headers = _section_headers(data)
        self.sections = [_section(data, header) for header in headers if header["flags"] & _ALLOC and header["size"]]
        self.symbols = {symbol.name: symbol for symbol in _symbols(data, headers, thumb=self.machine == ARM)}
        self.undefined = {name
                          for name, _, _, info, section in _symbol_table(data, headers) if not section and info >> 4}
        self._functions = sorted((s for s in self.symbols.values() if s.is_function), key=lambda s: s.address)

    def where(self, address: int) -> str:
        """`function+0x1a` for an address, or the bare address where no function is."""
        for symbol in self._functions:
            if symbol.address <= address < symbol.address + max(symbol.size, 2):
                return f"{symbol.name}+{address - symbol.address:#x}"
        return f"{address:#010x}"

    def flash_bytes(self) -> int:
        """Code, constants and the start values of variables."""
        return sum(len(section.data) for section in self.sections)

    def code_bytes(self) -> int:
        """Code alone."""
        return sum(section.size for section in self.sections if section.executable)

    def ram_bytes(self) -> int:
        """Variables: .data and .bss."""
        return sum(section.size for section in self.sections if section.writable)


def _section_headers(data: bytes) -> list[dict]:
    """The section headers of an ELF file, as dictionaries with their names."""
    offset, = struct.unpack_from("<I", data, 32)
    size, count, names = struct.unpack_from("<HHH", data, 46)
    fields = ("name", "type", "flags", "address", "offset", "size", "link", "info")
    headers = [dict(zip(fields, struct.unpack_from("<8I", data, offset + i * size), strict=True)) for i in range(count)]
    name_table = headers[names]["offset"]
    for header in headers:
        header["name"] = _text(data, name_table + header["name"])
    return headers


def _text(data: bytes, start: int) -> str:
    """The text at a place of a file, up to the next zero byte."""
    return data[start:data.index(b"\0", start)].decode()


def _section(data: bytes, header: dict) -> Section:
    """The section that a header describes."""
    content = b"" if header["type"] == _NOBITS else data[header["offset"]:header["offset"] + header["size"]]
    return Section(header["name"], header["address"], header["size"], content,
                   bool(header["flags"] & _WRITE), bool(header["flags"] & _EXECUTE))


def _symbol_table(data: bytes, headers: list[dict]) -> Iterator[tuple[str, int, int, int, int]]:
    """Name, value, size, info and section of each symbol that has a name; section 0 for those that are not here."""
    for table in (header for header in headers if header["type"] == _SYMTAB):
        text = headers[table["link"]]["offset"]
        for at in range(table["offset"], table["offset"] + table["size"], 16):
            name, value, size, info, _, section = struct.unpack_from("<IIIBBH", data, at)
            if name:
                yield _text(data, text + name), value, size, info, section


def _symbols(data: bytes, headers: list[dict], thumb: bool) -> list[Symbol]:
    """The functions and objects of the symbol table; `thumb`: addresses of functions have a mode bit."""
    symbols = []
    for name, value, size, info, section in _symbol_table(data, headers):
        function = info & 15 == _FUNCTION
        if section and info & 15 <= _FUNCTION:
            symbols.append(Symbol(name, value & ~1 if function and thumb else value, size, function, info >> 4 != 0))
    return symbols
