import base64
import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[2]


def test_a_wheel_works_where_nothing_of_the_source_is(tmp_path):
    package = Path(os.environ["PYTHONPATH"].split(":")[0]).resolve() / "seldinger"
    command = [sys.executable, SOURCE / "app" / "python" / "wheel.py", "--package", package, "--out"]
    made = [Path(subprocess.run([*command, tmp_path / name], capture_output=True, text=True, check=True).stdout.strip())
            for name in ("a", "b")]
    assert made[0].read_bytes() == made[1].read_bytes()
    assert made[0].name.startswith("seldinger-") and made[0].suffix == ".whl"
    with zipfile.ZipFile(made[0]) as wheel:
        names = wheel.namelist()
        record = wheel.read(next(name for name in names if name.endswith("/RECORD"))).decode()
        wheel.extractall(tmp_path / "site")
        for line in record.splitlines():
            name, digest, size = line.split(",")
            data = wheel.read(name)
            whole = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
            assert (digest, size) == (("", "") if name.endswith("/RECORD") else (f"sha256={whole}", str(len(data)))), name
    assert sorted(line.split(",")[0] for line in record.splitlines()) == sorted(names)
    assert any(name.endswith(".dist-info/licenses/LICENSE") for name in names)
    for needed in ("seldinger/__init__.py", "seldinger/py.typed", "seldinger/_core.pyi", "seldinger/gym/batch.py",
                   "seldinger/assets/scenarios/renal.toml", "seldinger/assets/devices/glide035.toml"):
        assert needed in names
    text = ("import seldinger as sd; sim = sd.Simulation('s_bend', cache=''); "
            "print(sd.__file__, sim.step(advance_mm=1).frame, len(sd.scenarios()), sd.gym.KEYS[0])")
    environment = {key: value for key, value in os.environ.items() if key != "SELDINGER_ASSETS"}
    result = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, cwd=tmp_path,
                            env=dict(environment, PYTHONPATH=str(tmp_path / "site")))
    shipped = {file.stem for file in (SOURCE / "assets/scenarios").glob("*.toml")} - {"benchmark"}
    assert result.stdout.split()[1:] == ["0", str(len(shipped)), "tracking2d"], result.stderr
    assert result.stdout.startswith(str(tmp_path / "site"))


def test_a_bundled_package_takes_every_library_but_the_c_library_from_itself(tmp_path):
    if not shutil.which("patchelf"):
        pytest.skip("no patchelf")
    package = Path(os.environ["PYTHONPATH"].split(":")[0]).resolve() / "seldinger"
    spec = importlib.util.spec_from_file_location("wheel", SOURCE / "app" / "python" / "wheel.py")
    wheel = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(wheel)
    (module,), libs, licences, platform = wheel.bundled([next(package.glob("_core*.so"))], tmp_path)
    assert re.fullmatch(r"manylinux_2_\d+_\w+", platform)
    for file in (module, *libs.iterdir()):
        assert all((libs / name).exists() for name in wheel.needed(file)), file
        # Another libstdc++ of the process would give its own for them.
        assert not re.search(r"\bUNIQUE\b", wheel.output("readelf", "-W", "--dyn-syms", file)), file
    shutil.copytree(package, tmp_path / "seldinger", ignore=shutil.ignore_patterns("_core*.so", "assets"))
    shutil.move(module, tmp_path / "seldinger")
    text = ("import seldinger as sd; sim = sd.Simulation('s_bend', cache=''); sim.step(); sim.image(64); "
            "print(*{line.split()[-1] for line in open('/proc/self/maps') if '.so' in line}, sep='\\n')")
    result = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, cwd=tmp_path,
                            env={**os.environ, "PYTHONPATH": str(tmp_path), "SELDINGER_ASSETS": str(SOURCE / "assets")})
    assert result.returncode == 0, result.stderr
    loaded = {Path(line) for line in result.stdout.splitlines()}
    of_us = {re.sub("-[0-9a-f]{8}", "", path.name) for path in loaded if path.parent == libs}
    assert {"libassimp.so.5", "libstdc++.so.6"} <= of_us and {"libOSMesa.so.8", "libEGL.so.1"} & of_us
    # Nothing of ours comes from the system as well, unless NumPy or Python brings it, as none but libz.so.1 is.
    assert not {path.name for path in loaded if path.parent != libs} & (of_us - {"libz.so.1"})
    if shutil.which("dpkg-query"):
        assert {"libassimp5.copyright", "zlib1g.copyright"} <= {path.name for path in licences.iterdir()}
    metadata = wheel.metadata("1.2.3", [SOURCE / "LICENSE"])
    for line in ("Version: 1.2.3", "License-Expression: MIT", "License-File: LICENSE", "Requires-Dist: numpy>=1.19"):
        assert line in metadata.splitlines()
