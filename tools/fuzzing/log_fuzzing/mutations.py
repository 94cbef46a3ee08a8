"""Mutations of any bytes and of text tables, each drawn from a `random.Random`."""

import gzip
from collections.abc import Callable
from random import Random

#: numbers and near-numbers that a cell may come to hold
EXTREMES = (
    *b"nan NaN -nan inf -inf Infinity 1e308 -1e308 1e309 1.8e308 5e-324 -5e-324 2.3e-308 1e-300 -0 0 1 -1 -0.0".split(),
    *b"1e38 4e38 -4e38 1e19 18446744073709551616 9223372036854775807 -9223372036854775808 4294967296 65535".split(),
    *b"65536 -32768 32767 1e10 1.1e10 1e16 2e9 1e-9 0x10 1_000 1e 1e+ . - + +5 .5 5. 1,5 1.5.2 12abc null".split(),
    *b"None NULL N/A # true \"1\" '1' 1d5 1f \xd9\xa1 \xc2\xb2 \xff\xfe \x00 \xe2\x88\x925 (5+0j) +-1 1e5e5".split(),
    b"", b" ", b"9" * 400, b"0." + b"3" * 400)
NAMES = (
    *b"t_s timestamp_ms acc_x_mps2 gyro_x_radps m1_pwm zrange_m x_m vx_mps roll_rad rpm_1 range_left_m acc.x".split(),
    *b"gyro.x gyro.xRaw motor.m1 pwm.m1_pwm stateEstimate.ax stateEstimateZ.ax stateEstimateZ.quat".split(),
    *b"stateEstimate.qw pm.vbat range.zrange pwm vbat[V] rpm1 1 nan humidity T_S \xff \xc3\xa9 \x1b[31m".split(),
    *b"\"t_s\" t_s# a:b".split())
META = (
    b"# sample_period_s: %s", b'# sample_period_s: "0.01"', b"# sample_period_s: [1]", b'# warnings: "x"',
    b'# warnings: [1, {"a": "\\ud800"}]', b'# warnings: ["a\\nb", "\\u001b[2J"]', b"# acc_frame: 3",
    b'# acc_frame: "world"', b"# vehicle: [[]]", b'# condition: {"wind": NaN}', b"# source: 5", b"# format: {}",
    b"# : 1", b"# a", b"#", b"# resampled: []", b"# x: \xff\xfe", b"# y: " + b"[" * 2000)

def any_bytes(data: bytes, r: Random) -> bytes:
    """Flipped, replaced, inserted, deleted, repeated or cut-off bytes."""
    out = bytearray(data)
    for _ in range(r.choice((1, 1, 2, 4, 16))):
        place = r.randrange(len(out) + 1)
        kind = r.randrange(8)
        if kind < 3 and place < len(out):
            out[place] ^= 1 << r.randrange(8)
        elif kind == 3 and place < len(out):
            out[place] = r.choice((0, 255, 10, 44, r.randrange(256)))
        elif kind == 4:
            out[place:place] = r.randbytes(r.choice((1, 2, 8, 50)))
        elif kind == 5:
            del out[place:place + r.choice((1, 2, 10, 100))]
        elif kind == 6:
            out[place:place] = out[place:place + r.choice((1, 8, 200))] * r.choice((1, 2, 20))
        else:
            out[place:place + r.choice((1, 4, 40))] = bytes([r.choice((0, 255, 32))]) * r.choice((1, 4, 40))
    return bytes(out[:r.randrange(len(out) + 1)] if r.random() < 0.15 else out)


def cut(data: bytes, r: Random) -> bytes:
    """The first part of the file."""
    return data[:r.randrange(len(data) + 1)]


def rows(data: bytes, r: Random) -> bytes:
    """Lines deleted, doubled, swapped, repeated, shuffled, turned round, or blank ones put between."""
    lines = data.splitlines(keepends=True) or [b""]
    for _ in range(r.choice((1, 1, 3))):
        a, b = r.randrange(len(lines)), r.randrange(len(lines))
        kind = r.randrange(8)
        if kind == 0:
            del lines[min(a, b):max(a, b)]
        elif kind == 1:
            lines[a:a] = lines[min(a, b):max(a, b)]
        elif kind == 2:
            lines[a], lines[b] = lines[b], lines[a]
        elif kind == 3:
            lines[a:a] = [lines[b]] * r.choice((1, 5, 60))
        elif kind == 4:
            r.shuffle(lines)
        elif kind == 5:
            lines.reverse()
        elif kind == 6:
            blank = r.choice((b"\n", b" \n", b"#\n", b"# a: 1\n", b",\n", b"\t\n", b"\x0c\n"))
            lines[a:a] = [blank] * r.choice((1, 30))
        elif len(lines) > 1:
            del lines[a]
        lines = lines or [b""]
    return b"".join(lines)


def _cells(data: bytes) -> list[list[bytes]]:
    """The cells of a CSV file, by line."""
    return [line.split(b",") for line in data.split(b"\n")]


def _join(table: list[list[bytes]]) -> bytes:
    """The CSV file of cells."""
    return b"\n".join(b",".join(row) for row in table)


def columns(data: bytes, r: Random) -> bytes:
    """A column deleted, doubled or swapped with another, in every line or from one line on."""
    table = _cells(data)
    first = r.choice((0, 0, r.randrange(len(table))))
    width = len(table[-2 if len(table) > 1 else 0])
    a, b, kind = r.randrange(width), r.randrange(width), r.randrange(4)
    for row in table[first:]:
        if max(a, b) < len(row):
            if kind == 0:
                del row[a]
            elif kind == 1:
                row.insert(b, row[a])
            elif kind == 2:
                row[a], row[b] = row[b], row[a]
            else:
                row[a] = row[b]
    return _join(table)


def numbers(data: bytes, r: Random) -> bytes:
    """Extreme numbers in a cell, a stretch of a column, or a whole column; or a column scaled and shifted."""
    table = _cells(data)
    for _ in range(r.choice((1, 1, 2, 4))):
        column = r.randrange(max(len(table[-2 if len(table) > 1 else 0]), 1))
        start = r.randrange(len(table))
        stop = r.choice((start + 1, start + 1, start + 5, len(table)))
        start = r.choice((start, start, 0))
        value, kind = r.choice(EXTREMES), r.randrange(4)
        scale, shift = r.choice((1.0, 1e-9, -1.0, 1e3, 1e9, 1e200, 0.0)), r.choice((0.0, 1e-3, 1.0, 60.0, 1e5, 1e12))
        for row in table[start:stop]:
            if column < len(row):
                row[column] = value if kind else _scale(row[column], scale, shift)
    return _join(table)


def _scale(cell: bytes, scale: float, shift: float) -> bytes:
    """A cell's number times a scale plus a shift; any other cell as it is."""
    try:
        return b"%r" % (float(cell) * scale + shift)
    except ValueError:
        return cell


def header(data: bytes, r: Random) -> bytes:
    """Another, doubled, empty or missing name; another, doubled or missing header; odd metadata."""
    lines = data.split(b"\n")
    place = next((i for i, line in enumerate(lines) if not line.startswith(b"#")), 0)
    names = lines[place].split(b",")
    kind, a = r.randrange(7), r.randrange(len(names))
    if kind < 2:
        names[a] = r.choice((*NAMES, *names, b"", b" ", b"n" * 5000, b"acc_x_mps2,acc_y_mps2"))
        lines[place] = b",".join(names)
    elif kind == 2:
        lines[place] = b",".join(r.sample(NAMES, r.randrange(1, 12)))
    elif kind == 3:
        lines.insert(r.randrange(len(lines)), lines[place])
    elif kind == 4:
        del lines[place]
    else:
        for line in r.choices(META, k=r.choice((1, 1, 3))):
            line = line.replace(b"%s", r.choice(EXTREMES))
            lines.insert(r.choice((0, place, r.randrange(len(lines)))), line)
    return b"\n".join(lines)


def encoding(data: bytes, r: Random) -> bytes:
    """Other encodings, separators and line ends; giant fields."""
    kind = r.randrange(9)
    place = r.randrange(len(data) + 1)
    if kind == 0:
        other = r.choice(("utf-16", "utf-16-le", "utf-32", "utf-8-sig", "cp037", "utf-7"))
        return data.decode("latin-1").encode(other)
    if kind == 1:
        return data.replace(b",", r.choice((b";", b"\t", b" ", b", ", b" , ", b",,", b"|")))
    if kind == 2:
        return data.replace(b".", b",")
    if kind == 3:
        ends = (b"\n", b"\r\n", b"\r", b"\n\r", b"\x0b", b"\x85", b"\xe2\x80\xa8", b"\n\n", b"\x00\n")
        few = r.choices(ends, k=r.choice((1, 2, 4)))
        return b"".join(line + r.choice(few) for line in data.split(b"\n"))
    if kind == 4:
        return data.rstrip(b"\n") + r.choice((b"", b"\r", b"\x00", b"\x1a", b",", b"\n,\n", b"\n\x00\n", b"1"))
    if kind == 5:
        giant = r.choice((b"1", b"0", b"x", b",", b"\n", b" ", b"-", b"1e", b"#", b"[", b"\xff", b"1,", b",\n", b"1\n"))
        return data[:place] + giant * r.choice((1000, 20000)) + data[place:]
    if kind == 6:
        marks = (b"\xef\xbb\xbf", b"\xff\xfe", b"\x00", b"\xbc", b"PAR1", b"\x1f\x8b", b" ", b"\n\n", b"sep=,\n")
        return r.choice(marks) + data
    if kind == 7:
        odd = r.choice(("\u00e9", "\uff11", "\u0663", "\ud800", "\u202e", "\u2212", "\u200b"))
        return data[:place] + odd.encode("utf-8", "surrogatepass") + data[place:]
    return data.replace(b"e", r.choice((b"E", b"d", b"")))


def zip_again(data: bytes, r: Random) -> bytes:
    """Packed again, in several members, with a tail, cut or damaged."""
    half = len(data) // 2
    kind = r.randrange(10)
    if kind == 0:
        return gzip.compress(data[:half], 1, mtime=0) + gzip.compress(data[half:], 1, mtime=0)
    packed = gzip.compress(data, 1, mtime=0)
    if kind == 1:
        return packed + r.choice((b"\0" * 50, b"tail", b"\x1f\x8b", packed))
    if kind == 2:
        return cut(packed, r)
    if kind == 3:
        return gzip.compress(packed, 1, mtime=0)
    if kind == 4:
        return gzip.compress(b"", mtime=0) * r.choice((1, 300)) + packed
    return any_bytes(packed, r) if kind == 5 else packed


#: mutations of a text table, as often as they are drawn
TEXT: tuple[Callable[[bytes, Random], bytes], ...] = (
    any_bytes, any_bytes, cut, rows, rows, columns, columns, *[numbers] * 4, header, header, encoding)


def text(data: bytes, r: Random) -> bytes:
    """One to three mutations of a text table, now and then packed."""
    for _ in range(r.choice((1, 1, 1, 2, 3))):
        data = r.choice(TEXT)(data, r)
    return zip_again(data, r) if r.random() < 0.03 else data


def packed_text(data: bytes, r: Random) -> bytes:
    """A gzipped text table: its text mutated, or its packed bytes."""
    if r.random() < 0.3:
        return any_bytes(data, r)
    return zip_again(text(gzip.decompress(data), r), r)
