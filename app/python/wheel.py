#!/usr/bin/env python3
"""Makes a wheel of the module in build/python: /usr/bin/python3 app/python/wheel.py [--out build/python]

A wheel is a zip file with a list of what is in it (PEP 427); nothing but Python itself is needed. It holds the module, its
stubs, scenarios, scripts and devices, and takes the engine's libraries from the system, as the Debian package does.

With --bundle (needs patchelf) the wheel holds the libraries too, in seldinger.libs/, all but those of the C library, and
works on any Linux whose C library is as new as the one that they were built with. Its tag says which (PEP 600).

With --portable (needs patchelf and Debian's packages, see portable.py) the module is built for glibc 2.28 and newer, with the
libraries of Debian 11; for this CPython, or for each that is given by its name, its file or its folder of headers:

    /usr/bin/python3 app/python/wheel.py --portable --python python3.9 --python ~/cpython-3.13/include/python3.13"""

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

sys.path.insert(0, str(Path(__file__).resolve().parent))
import portable  # noqa: E402

SOURCE = Path(__file__).resolve().parents[2]
STAMP = (1980, 1, 1, 0, 0, 0)  # equal inputs give equal bytes


def files(package, module):
    """What belongs in the wheel: (name there, path)."""
    for path in sorted([*package.rglob("*"), module]):
        inside = Path(path.name) if path == module else path.relative_to(package)
        if path.is_file() and inside.parts[0] != "assets" and "__pycache__" not in inside.parts and \
                (path == module or not path.match("_core*.so")):
            yield "seldinger/" + inside.as_posix(), path
    for folder in ("scenarios", "scripts", "devices"):
        for path in sorted((SOURCE / "assets" / folder).iterdir()):
            if path.suffix in (".toml", ".gw"):
                yield f"seldinger/assets/{folder}/{path.name}", path


# Of the C library, and the unwinder of exceptions, which a process has once. PEP 600 allows them, and more that few machines lack.
SYSTEM = re.compile(r"ld-linux.*|lib(c|m|dl|pthread|rt|resolv|util|anl)\.so\.\d+|libnsl\.so\.1|libgcc_s\.so\.1")
NEWEST_UNWINDER = (7, 0, 0)  # that systems with glibc 2.28 have


def output(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout


def needed(file):
    return [name for name in re.findall(r"\(NEEDED\).*\[(.*)\]", output("readelf", "-W", "-d", file)) if not SYSTEM.fullmatch(name)]


def asked(file, library):
    """Versions of a library that a file asks for, as (2, 35)."""
    found = re.findall(rf"Name: {library}_([\d.]+)", output("readelf", "-W", "--version-info", file))
    return [tuple(map(int, version.split("."))) for version in found]


def libraries(module, root):
    """Every library that it loads, by the name that it is asked for."""
    folders = [root / folder for folder in (*portable.FOLDERS, "usr/lib64", "lib64", "usr/local/lib", "usr/lib", "lib")]
    found, left = {}, [module]
    while left:
        for name in needed(left.pop()):
            if name not in found:
                place = next((folder / name for folder in folders if (folder / name).exists()), None)
                if place is None:
                    raise SystemExit(f"wheel: {module} needs {name}, which was not found in " + ", ".join(map(str, folders)))
                found[name] = place.resolve()
                left.append(place)
    return found


def bundled(modules, work, root=Path("/")):
    """Copies of the modules, and of the libraries that they load, each under a name of its own, so that a process may have
    others of theirs: the modules, the folder of libraries, the folder of their licences, and the tag of the platform."""
    if not shutil.which("patchelf"):
        raise SystemExit("wheel: patchelf was not found; ./app/setup.sh test installs it")
    libs, licences = work / "seldinger.libs", work / "licences"
    libs.mkdir()
    licences.mkdir()
    found = {name: place for module in modules for name, place in libraries(module, root).items()}
    names = {}
    for name, place in sorted(found.items()):
        first, _, rest = name.partition(".so")
        names[name] = f"{first}-{hashlib.sha256(place.read_bytes()).hexdigest()[:8]}.so{rest}"
        shutil.copy(place, libs / names[name])
        package = portable.owner(place, root)
        if package:
            shutil.copy(root / "usr" / "share" / "doc" / package / "copyright", licences / f"{package}.copyright")
    made = []
    for module in modules:
        made.append(work / module.name)
        shutil.copy(module, made[-1])
    for file in (*libs.iterdir(), *made):
        file.chmod(0o755)
        is_library = file.parent == libs
        swaps = [part for name in needed(file) for part in ("--replace-needed", name, names[name])]
        # One kind of change a call: patchelf 0.14 mixes them up.
        for change in (["--set-soname", file.name] if is_library else [], swaps,
                       ["--set-rpath", "$ORIGIN" if is_library else "$ORIGIN/../seldinger.libs"]):
            if change:
                output("patchelf", *change, file)
        portable.fit(file)
    everything = [*made, *libs.iterdir()]
    for file in everything:
        strange = [name for name in needed(file) if not (libs / name).exists()]
        if strange or max(asked(file, "GCC"), default=(0,)) > NEWEST_UNWINDER:
            raise SystemExit(f"wheel: {file.name} wants of the system what not every one has: {strange or 'a newer libgcc_s'}")
    major, minor = max(version for file in everything for version in asked(file, "GLIBC"))[:2]
    machine = sysconfig.get_platform().split("-")[-1]
    return made, libs, licences, f"manylinux_{major}_{minor}_{machine}"


METADATA = """Metadata-Version: 2.4
Name: seldinger
Version: {version}
Summary: Guidewire training simulator: wire physics, live fluoroscopy, scores, environments for learning
Author: The Seldinger authors
License-Expression: MIT
{licences}Keywords: guidewire,catheter,fluoroscopy,simulation,reinforcement learning
Classifier: Development Status :: 4 - Beta
Classifier: Intended Audience :: Science/Research
Classifier: Operating System :: POSIX :: Linux
Classifier: Programming Language :: C++
Classifier: Programming Language :: Python :: 3
Classifier: Programming Language :: Python :: 3.9
Classifier: Programming Language :: Python :: 3.10
Classifier: Programming Language :: Python :: 3.11
Classifier: Programming Language :: Python :: 3.12
Classifier: Programming Language :: Python :: 3.13
Classifier: Programming Language :: Python :: Implementation :: CPython
Classifier: Topic :: Scientific/Engineering :: Medical Science Apps.
Classifier: Typing :: Typed
Requires-Python: >=3.9
Requires-Dist: numpy>=1.19
Provides-Extra: gym
Requires-Dist: gymnasium>=0.29; extra == "gym"
Description-Content-Type: text/markdown

{text}
"""


def metadata(version, licences):
    """Name, licences and text as pip shows them."""
    text = (SOURCE / "docs" / "python" / "start.md").read_text()
    return METADATA.format(version=version, licences="".join(f"License-File: {path.name}\n" for path in licences), text=text)


def build(package, out, version, module, tag, libs=None, licences=None, platform=None):
    platform = platform or sysconfig.get_platform().replace("-", "_").replace(".", "_")
    info = f"seldinger-{version}.dist-info"
    licences = [SOURCE / "LICENSE", *(sorted(licences.iterdir()) if licences else [])]
    meta = {
        f"{info}/METADATA": metadata(version, licences),
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

        for name, path in files(package, module):
            add(name, path.read_bytes())
        for place, paths in (("seldinger.libs", sorted(libs.iterdir()) if libs else []), (f"{info}/licenses", licences)):
            for path in paths:
                add(f"{place}/{path.name}", path.read_bytes())
        for name, text in meta.items():
            add(name, text.encode())
        write(f"{info}/RECORD", ("".join(record) + f"{info}/RECORD,,\n").encode())
    unfinished.replace(wheel)
    return wheel


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--package", type=Path, default=SOURCE / "build" / "python" / "seldinger")
    parser.add_argument("--out", type=Path, default=SOURCE / "build" / "python")
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument("--bundle", action="store_true", help="puts the libraries in, for other distributions; needs patchelf")
    kind.add_argument("--portable", action="store_true", help="builds for glibc 2.28 and newer, and puts the libraries in")
    parser.add_argument("--python", action="append", help="with --portable: a CPython to make a wheel for; may be repeated")
    parser.add_argument("--work", type=Path, default=portable.WORK, help="folder of --portable, kept for the next time")
    parser.add_argument("--mirror", help="with --portable: address of Debian's packages; by default that of this machine's apt")
    options = parser.parse_args()
    module = next(options.package.glob("_core*.so"), None)
    if not module:
        print(f"wheel: {options.package} holds no module; ./app/python.sh builds it", file=sys.stderr)
        return 2
    sys.path.insert(0, str(options.package.parent))
    sys.dont_write_bytecode = True
    import seldinger
    options.out.mkdir(parents=True, exist_ok=True)
    root, modules = Path("/"), {f"cp{sys.version_info.major}{sys.version_info.minor}": module}
    if options.portable:
        root = portable.build_root(options.work.resolve(), options.mirror)
        modules = portable.build_modules(options.work.resolve(), root, options.python or [sys.executable])
    if root == Path("/") and not options.bundle:
        print(build(options.package, options.out, seldinger.__version__, module, *modules))
        return 0
    with tempfile.TemporaryDirectory() as work:
        copies, *rest = bundled(list(modules.values()), Path(work), root)
        for tag, copy in zip(modules, copies):
            print(build(options.package, options.out, seldinger.__version__, copy, tag, *rest), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
