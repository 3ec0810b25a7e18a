#!/usr/bin/env python3
"""Makes a wheel of the module in build/python: /usr/bin/python3 app/python/wheel.py [--out build/python]

A wheel is a zip file with a list of what is in it (PEP 427); nothing but Python itself is needed. It holds the module, its
stubs, scenarios, scripts and devices, and takes the engine's libraries from the system, as the Debian package does.

With --bundle (needs patchelf) the wheel holds the libraries too, in seldinger.libs/, all but those of the C library, and
works on any Linux whose C library is as new as the one that they were built with. Its tag says which (PEP 600)."""

import argparse
import base64
import hashlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
STAMP = (1980, 1, 1, 0, 0, 0)  # equal inputs give equal bytes


def files(package):
    """What belongs in the wheel: (name there, path)."""
    for path in sorted(package.rglob("*")):
        inside = path.relative_to(package)
        if path.is_file() and inside.parts[0] != "assets" and "__pycache__" not in inside.parts:
            yield "seldinger/" + inside.as_posix(), path
    for folder in ("scenarios", "scripts", "devices"):
        for path in sorted((SOURCE / "assets" / folder).iterdir()):
            if path.suffix in (".toml", ".gw"):
                yield f"seldinger/assets/{folder}/{path.name}", path


# Of the C library, which a process has once. PEP 600 allows them, and more that few machines lack.
SYSTEM = re.compile(r"(ld-linux.*|lib(c|m|dl|pthread|rt|resolv|util|nsl|anl)\.so.*|linux-vdso.*)$")


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def libraries(module):
    """Every library that it loads, by the name that it is asked for."""
    found = {}
    for line in output("ldd", str(module)).splitlines():
        name, _, place = line.strip().partition(" => ")
        if SYSTEM.match(name.split("/")[-1].split(" ")[0]):
            continue
        if "not found" in place or not place:
            raise SystemExit(f"wheel: {module} needs {name}, which was not found")
        found[name] = Path(place.rsplit(" (", 1)[0])
    return found


def newest_glibc(files):
    """The newest version of the C library that one of the files asks for, as (2, 35)."""
    asked = set()
    for file in files:
        asked |= set(re.findall(r"Name: GLIBC_(\d+)\.(\d+)", output("readelf", "-W", "--version-info", str(file))))
    return max((int(major), int(minor)) for major, minor in asked)


def bundled(package, work):
    """A copy of the package with the libraries beside it; the copy, the folder of libraries, and the tag of the platform."""
    if not shutil.which("patchelf"):
        raise SystemExit("wheel: --bundle needs patchelf, which was not found")
    copy, folder = work / "seldinger", work / "seldinger.libs"
    shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__", "assets"))
    folder.mkdir()
    module = next(copy.glob("_core*.so"))
    for name, place in sorted(libraries(module).items()):
        shutil.copy(place.resolve(), folder / name)
        (folder / name).chmod(0o755)
        output("patchelf", "--set-rpath", "$ORIGIN", str(folder / name))
    output("patchelf", "--set-rpath", "$ORIGIN/../seldinger.libs", str(module))
    major, minor = newest_glibc([module, *folder.iterdir()])
    machine = sysconfig.get_platform().split("-")[-1]
    return copy, folder, f"manylinux_{major}_{minor}_{machine}"


METADATA = """Metadata-Version: 2.1
Name: seldinger
Version: {version}
Summary: Guidewire training simulator: wire physics, live fluoroscopy, scores, environments for learning
Author: The Seldinger authors
License: {licence}
Keywords: guidewire,catheter,fluoroscopy,simulation,reinforcement learning
Classifier: Development Status :: 4 - Beta
Classifier: Intended Audience :: Science/Research
Classifier: Operating System :: POSIX :: Linux
Classifier: Programming Language :: C++
Classifier: Programming Language :: Python :: 3
Classifier: Topic :: Scientific/Engineering :: Medical Science Apps.
Classifier: Typing :: Typed
Requires-Python: =={python}.*
Requires-Dist: numpy
Provides-Extra: gym
Requires-Dist: gymnasium>=0.29; extra == "gym"
Description-Content-Type: text/markdown

{text}
"""


def metadata(version):
    """Name, licence and text as pip shows them. `Requires-Python` is this Python alone: the module is of its version."""
    licence = (SOURCE / "LICENSE").read_text().splitlines()[0].strip()
    text = (SOURCE / "docs" / "python" / "start.md").read_text()
    return METADATA.format(version=version, licence=licence, text=text,
                           python=f"{sys.version_info.major}.{sys.version_info.minor}")


def build(package, out, version, libs=None, platform=None):
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = platform or sysconfig.get_platform().replace("-", "_").replace(".", "_")
    info = f"seldinger-{version}.dist-info"
    meta = {
        f"{info}/METADATA": metadata(version),
        f"{info}/LICENSE": (SOURCE / "LICENSE").read_text(),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: seldinger\nRoot-Is-Purelib: false\nTag: {tag}-{tag}-{platform}\n",
    }
    wheel = out / f"seldinger-{version}-{tag}-{tag}-{platform}.whl"
    unfinished = wheel.with_suffix(".part")
    record = []
    with zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as zipped:
        def add(name, data):
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append(f"{name},sha256={digest},{len(data)}\n")
            write(name, data)

        def write(name, data):
            entry = zipfile.ZipInfo(name, STAMP)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            zipped.writestr(entry, data)

        for name, path in files(package):
            add(name, path.read_bytes())
        for path in sorted(libs.iterdir()) if libs else []:
            add(f"seldinger.libs/{path.name}", path.read_bytes())
        for name, text in meta.items():
            add(name, text.encode())
        write(f"{info}/RECORD", ("".join(record) + f"{info}/RECORD,,\n").encode())
    unfinished.replace(wheel)
    return wheel


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--package", type=Path, default=SOURCE / "build" / "python" / "seldinger")
    parser.add_argument("--out", type=Path, default=SOURCE / "build" / "python")
    parser.add_argument("--bundle", action="store_true", help="puts the libraries in, for other distributions; needs patchelf")
    options = parser.parse_args()
    if not list(options.package.glob("_core*.so")):
        print(f"wheel: {options.package} holds no module; ./app/python.sh builds it", file=sys.stderr)
        return 2
    sys.path.insert(0, str(options.package.parent))
    sys.dont_write_bytecode = True
    import seldinger
    options.out.mkdir(parents=True, exist_ok=True)
    if not options.bundle:
        print(build(options.package, options.out, seldinger.__version__))
        return 0
    with tempfile.TemporaryDirectory() as work:
        package, libs, platform = bundled(options.package, Path(work))
        print(build(package, options.out, seldinger.__version__, libs, platform))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
