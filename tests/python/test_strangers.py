"""Files that were made to hurt: each kind in ten ways. The program refuses them in its own words, with no more memory than the file
honestly says that it needs four times over, and unread where a limit is named (docs/developers/readers.md)."""

import bz2
import gzip
import itertools
import json
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import pytest

USUAL = 160  # of a run that reads no stranger's file [MB]

# The most memory that a command and its children had, by a small process: a large one would count its own.
MEASURE = """import resource, subprocess, sys
ended = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL)
print(ended.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"""


def run(program, *arguments, megabytes=USUAL):
    """What a command says as it refuses."""
    ended = subprocess.run([sys.executable, "-c", MEASURE, program, *map(str, arguments)], capture_output=True, text=True)
    code, kilobytes = map(int, ended.stdout.split())
    said = ended.stderr
    assert code == 2, said
    assert said.startswith("seldinger: ") and "defect" not in said, said
    assert kilobytes < 1024 * megabytes, f"{kilobytes / 1024:.0f} MB: {said}"
    return said


@pytest.fixture
def read_ct(program, cache, tmp_path):
    """Runs an exercise in the body of a CT."""
    scenario = Path(__file__).resolve().parents[2] / "assets" / "scenarios" / "s_bend.toml"

    def of(ct, **options):
        text = scenario.read_text().replace("patient = false", "patient = true") + f'\n[patient]\nct = "{ct}"\n'
        own = tmp_path / "own.toml"
        own.write_text(text)
        script = tmp_path / "own.gw"
        script.write_text("0 beam on\n2 end\n")
        return run(program, "run", own, "--commands", script, "--out", tmp_path / "out", "--cache", cache, **options)
    return of


@pytest.fixture
def read_mesh(program, tmp_path):
    def of(path, **options):
        return run(program, "anatomy", "import", path, "--unit", "mm", "--out", tmp_path / "out", **options)
    return of


# DICOM

def element(group, number, kind, value):
    value += (b"\0" if kind in (b"UI", b"OB", b"UN") else b" ") * (len(value) % 2)
    long = kind in (b"OB", b"OW", b"SQ", b"UN", b"UT")
    head = struct.pack("<HH2s", group, number, kind)
    return head + (struct.pack("<HI", 0, len(value)) if long else struct.pack("<H", len(value))) + value


def dicom_file(body, syntax=b"1.2.840.10008.1.2.1"):
    meta = element(2, 1, b"OB", b"\0\1") + element(2, 2, b"UI", b"1.2.840.10008.5.1.4.1.1.2") \
        + element(2, 3, b"UI", b"1.2.3.1") + element(2, 0x10, b"UI", syntax)
    return bytes(128) + b"DICM" + element(2, 0, b"UL", struct.pack("<I", len(meta))) + meta + body


HEAD = element(8, 0x16, b"UI", b"1.2.840.10008.5.1.4.1.1.2") + element(8, 0x18, b"UI", b"1.2.3.1") + element(8, 0x60, b"CS", b"CT")


def nested(depth, group=8, number=0x1140, explicit=True, closed=True, sized=False):
    """A sequence in a sequence, and so on."""
    endless = b"\xff\xff\xff\xff"
    if sized:
        inner = b""
        for _ in range(depth):
            item = struct.pack("<HHI", 0xFFFE, 0xE000, len(inner)) + inner
            inner = struct.pack("<HH2sHI", group, number, b"SQ", 0, len(item)) + item
        return inner
    sequence = struct.pack("<HH", group, number) + (b"SQ\0\0" if explicit else b"") + endless
    begin = sequence + struct.pack("<HH", 0xFFFE, 0xE000) + endless
    end = struct.pack("<HHI", 0xFFFE, 0xE00D, 0) + struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)
    return begin * depth + (end * depth if closed else b"")


def test_sequences_within_sequences(read_ct, tmp_path):
    implicit = b"1.2.840.10008.1.2"
    head = b"".join(struct.pack("<HHI", 8, number, len(value)) + value
                    for number, value in ((0x16, b"1.2.840.10008.5.1.4.1.1.2\0"), (0x60, b"CT")))
    ways = [dicom_file(HEAD + nested(65)), dicom_file(HEAD + nested(6000)), dicom_file(HEAD + nested(100_000)),
            dicom_file(HEAD + nested(6000, closed=False)), dicom_file(HEAD + nested(1500, sized=True)),
            dicom_file(HEAD + nested(6000, group=9, number=0x1001)), dicom_file(head + nested(6000, explicit=False), implicit),
            dicom_file(head + nested(100_000, explicit=False, closed=False), implicit),
            dicom_file(HEAD + nested(6000)[:-7]),
            dicom_file((lambda deflate: deflate.compress(HEAD + nested(20_000)) + deflate.flush())(zlib.compressobj(9, zlib.DEFLATED, -15)),
                       b"1.2.840.10008.1.2.1.99")]
    for number, way in enumerate(ways):
        folder = tmp_path / f"ct{number}"
        folder.mkdir()
        (folder / "0.dcm").write_bytes(way)
        assert "64" in read_ct(folder), number


def deflated(*pieces):
    deflate = zlib.compressobj(9, zlib.DEFLATED, -15)
    return b"".join(deflate.compress(piece) for piece in pieces) + deflate.flush()


def zeros(megabytes):
    return itertools.repeat(bytes(1 << 20), megabytes)


def test_deflated_files_that_are_larger_than_they_look(read_ct, tmp_path):
    def pixels(size, tag=(0x7FE0, 0x10)):
        return HEAD + struct.pack("<HH2sHI", *tag, b"OW", 0, size)

    bombs = [deflated(HEAD, *zeros(70)), deflated(HEAD, *zeros(250)), deflated(*zeros(200)),
             deflated(pixels(1 << 30), *zeros(100)), deflated(pixels(0xFFFFFFFE), *zeros(70)),
             deflated(pixels(100 << 20, (9, 0x1001)), *zeros(101)), deflated(HEAD, nested(1_000_000, closed=False)),
             deflated(*itertools.repeat(HEAD, 1_300_000)), deflated(HEAD, *zeros(70))[:-4], deflated(HEAD, *zeros(70)) + bytes(1000)]
    for number, bomb in enumerate(bombs):
        folder = tmp_path / f"ct{number}"
        folder.mkdir()
        (folder / "0.dcm").write_bytes(dicom_file(bomb, b"1.2.840.10008.1.2.1.99"))
        said = read_ct(folder, megabytes=USUAL + 130)
        assert "64" in said, (number, said)


# Samples

def nifti(shape, kind=4, bits=16):
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *shape, 1, 1, 1, 1)
    struct.pack_into("<hh", head, 70, kind, bits)
    struct.pack_into("<8f", head, 76, 1, 1, 1, 1, 1, 1, 1, 1)
    struct.pack_into("<fff", head, 108, 352, 1, 0)
    struct.pack_into("<hh", head, 252, 0, 1)
    for row in range(3):
        struct.pack_into("<4f", head, 280 + 16 * row, *[float(row == column) for column in range(3)], 0)
    head[344:348] = b"n+1\0"
    return bytes(head)


def nrrd(sizes, encoding, more=""):
    return (f"NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: {sizes[0]} {sizes[1]} {sizes[2]}\n"
            f"space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nendian: little\nencoding: {encoding}\n{more}\n").encode()


def packed(pieces, by=None):
    by = by or zlib.compressobj(9, zlib.DEFLATED, 31)
    return b"".join(by.compress(piece) for piece in pieces) + by.flush()


def test_compressed_samples_that_are_not_as_many_as_the_header_says(read_ct, tmp_path):
    small = (20, 20, 20)
    files = {
        "more.nii.gz": packed([nifti(small), *zeros(250)]),
        "members.nii.gz": packed([nifti(small)]) + gzip.compress(bytes(100)) * 100_000,
        "many.nii.gz": packed([nifti((32767, 32767, 32767)), *zeros(10)]),
        "fewer.nii.gz": packed([nifti((800, 800, 900)), *zeros(3)]),
        "twice.nii.gz": gzip.compress(packed([nifti(small), *zeros(250)])),
        "more.nrrd": nrrd(small, "gzip") + packed(zeros(250)),
        "zlib.nrrd": nrrd((800, 800, 900), "gzip") + zlib.compress(bytes(3 << 20)),
        "more-bz2.nrrd": nrrd(small, "bzip2") + bz2.compress(bytes(100 << 20)),
        "fewer-bz2.nrrd": nrrd((800, 800, 900), "bzip2") + bz2.compress(bytes(3 << 20)),
        "many.nrrd": nrrd((2_000_000_000, 2_000_000_000, 2), "gzip") + packed(zeros(10)),
    }
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        assert name in read_ct(tmp_path / name), name


# Meshes

def test_faces_of_many_corners(read_mesh, tmp_path):
    count = 200_000
    corners = "".join(f"v {k % 447} {k // 447} 0\n" for k in range(count))
    each = range(1, count + 1)
    words = {"plain": " ".join(map(str, each)), "slashes": " ".join(f"{k}//{k}" for k in each),
             "negative": " ".join(str(-k) for k in each), "continued": " \\\n".join(map(str, each)),
             "tabs": "\t".join(map(str, each)), "repeated": "1 " * count, "returns": "\r".join(map(str, each))}
    files = {f"{name}.obj": f"{corners}f {text}\n" for name, text in words.items()}
    files["line.obj"] = f"{corners}l {words['plain']}\n"
    files["polygon.off"] = f"OFF\n{count} 1 0\n" + corners.replace("v ", "") + f"{count} " + " ".join(str(k) for k in range(count)) + "\n"
    files["polygon.ply"] = (f"ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
                            f"element face 1\nproperty list int int vertex_indices\nend_header\n" + corners.replace("v ", "")
                            + f"{count} " + " ".join(str(k) for k in range(count)) + "\n")
    for name, text in files.items():
        (tmp_path / name).write_text(text)
        assert "1000" in read_mesh(tmp_path / name, megabytes=USUAL + 40), name


# What is read beside a file

OUTSIDE = ["../outside.bin", "/etc/passwd", "folder/../../outside.bin", "./../outside.bin", "../../../../../../etc/passwd",
           "folder/../../../outside.bin", "..//outside.bin", "/proc/self/environ", "./folder/.././../outside.bin", "folder//../..//outside.bin"]


@pytest.fixture
def place(tmp_path):
    """A folder with another inside, and a file outside."""
    (tmp_path / "outside.bin").write_bytes(bytes(100_000))
    inside = tmp_path / "inside"
    (inside / "folder").mkdir(parents=True)
    return inside


@pytest.mark.parametrize("name", OUTSIDE)
def test_what_a_file_names_outside_its_folder_is_not_read(read_mesh, read_ct, program, place, name):
    gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "buffers": [{"byteLength": 360, "uri": name}],
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 360}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 30, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]}]}
    (place / "a.gltf").write_text(json.dumps(gltf))
    assert "beside" in read_mesh(place / "a.gltf")
    (place / "a.nhdr").write_bytes(nrrd((20, 20, 20), "raw", f"data file: {name}\n"))
    assert "beside" in read_ct(place / "a.nhdr")
    (place / "a.mhd").write_text("ObjectType = Image\nNDims = 3\nDimSize = 20 20 20\nElementSpacing = 1 1 1\nOffset = 0 0 0\n"
                                 f"ElementType = MET_SHORT\nElementDataFile = {name}\n")
    assert "beside" in read_ct(place / "a.mhd")
