#!/usr/bin/env python3
"""Makes a wheel of the module in build/python: /usr/bin/python3 app/python/wheel.py [--out build/python]

A wheel is a zip file with a list of what is in it (PEP 427); nothing but Python itself is needed. It holds the module, its
stubs, scenarios, scripts and devices, and takes the engine's libraries from the system, as the Debian package does."""

import argparse
import base64
import hashlib
import sys
import sysconfig
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


def build(package, out, version):
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    info = f"seldinger-{version}.dist-info"
    meta = {
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: seldinger\nVersion: {version}\n"
                            "Summary: Guidewire training simulator: wire physics, live fluoroscopy, scores\n"
                            "Requires-Python: >=3.9\nRequires-Dist: numpy\n",
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
        for name, text in meta.items():
            add(name, text.encode())
        write(f"{info}/RECORD", ("".join(record) + f"{info}/RECORD,,\n").encode())
    unfinished.replace(wheel)
    return wheel


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--package", type=Path, default=SOURCE / "build" / "python" / "seldinger")
    parser.add_argument("--out", type=Path, default=SOURCE / "build" / "python")
    options = parser.parse_args()
    if not list(options.package.glob("_core*.so")):
        print(f"wheel: {options.package} holds no module; ./app/python.sh builds it", file=sys.stderr)
        return 2
    sys.path.insert(0, str(options.package.parent))
    sys.dont_write_bytecode = True
    import seldinger
    options.out.mkdir(parents=True, exist_ok=True)
    print(build(options.package, options.out, seldinger.__version__))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
