#!/usr/bin/env python3
"""frame_difference.py FOLDER FOLDER: how many frames of two runs differ, and by how many grey levels at most. Fails where a
frame is missing or differs by more than two levels. What is compared are pixels: libdeflate's versions compress them to
other bytes."""

import pathlib
import struct
import sys
import zlib


def rows(file):
    """The rows of a grey 8-bit PNG, without their filters."""
    data, at, packed, width = file.read_bytes(), 8, b"", 0
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, _, depth, colour = struct.unpack(">IIBB", body[:10])
            assert (depth, colour) == (8, 0), f"{file}: expected 8 bits of grey, found depth {depth}, colour {colour}"
        elif kind == b"IDAT":
            packed += body
        at += size + 12
    raw, above, found = zlib.decompress(packed), bytearray(width), []
    for start in range(0, len(raw), width + 1):
        filter_, row = raw[start], bytearray(raw[start + 1 : start + 1 + width])
        for x in range(width):
            left, up, corner = (row[x - 1] if x else 0), above[x], (above[x - 1] if x else 0)
            if filter_ == 4:
                guess = left + up - corner
                near = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
            else:
                near = (0, left, up, (left + up) // 2)[filter_]
            row[x] = (row[x] + near) & 255
        found.append(row)
        above = row
    return found


def main(first, second):
    names = sorted(file.name for file in pathlib.Path(first).glob("*.png"))
    others = sorted(file.name for file in pathlib.Path(second).glob("*.png"))
    if not names or names != others:
        sys.exit(f"expected the same frames, found {len(names)} and {len(others)}")
    differing, largest = 0, 0
    for name in names:
        one, two = pathlib.Path(first, name), pathlib.Path(second, name)
        if one.read_bytes() == two.read_bytes():
            continue
        most = max(abs(a - b) for p, q in zip(rows(one), rows(two)) for a, b in zip(p, q))
        differing += most > 0
        largest = max(largest, most)
    print(f"{differing}/{len(names)} by {largest}" if differing else "equal")
    return largest > 2


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
