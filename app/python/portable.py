"""The modules of portable wheels: built by this machine's g++ against the libraries of Debian 11, whose glibc is 2.31, and what
of a library can be told apart from a newer glibc's.

Debian 11 lacks a C++ library for C++20. What g++ wants beyond it is taken from g++'s own libstdc++.a into the module, and what
that wants of a newer glibc is in older_glibc.cpp. Headers of Debian 11 that are too old come from Debian 12 and 13.
"""

import json
import os
import re
import shutil
import struct
import subprocess
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
# Not in the source's folder, where CMake wants no libraries.
WORK = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "seldinger-wheels"
MACHINE = "x86_64"
FOLDERS = (f"usr/lib/{MACHINE}-linux-gnu", f"lib/{MACHINE}-linux-gnu")
KEYS = Path("/usr/share/keyrings/debian-archive-keyring.gpg")
LIBRARIES = """libc6-dev libstdc++6 libosmesa6-dev libassimp-dev libdcmtk-dev libpugixml-dev libpng-dev zlib1g-dev libbz2-dev
               libnifti-dev libopenjp2-7-dev libseccomp-dev""".split()
# Headers, and static libraries, which want no newer glibc.
HEADERS = [f"{name}/bookworm" for name in ("libeigen3-dev", "libglm-dev", "libtomlplusplus-dev", "nlohmann-json3-dev",
                                           "libfmt-dev", "libcli11-dev", "libimgui-dev", "libstb-dev", "libdeflate-dev")]
# Debian 11's Embree is of 487 MB. What this one wants of a newer glibc can be done without.
HEADERS += ["libembree-dev/bookworm", "libembree3-3/bookworm", "libtbb12/bookworm"]
HEADERS.append("pybind11-dev/trixie")  # knows CPython 3.13
# What may be asked for without a version, and so be what an older glibc has of it: these functions do and take the same in all
# versions, but for how those of mathematics report errors. Data, and what libstdc++ lacks, is in the module (older_glibc.cpp).
UNVERSIONED = re.compile("exp|exp2|log|log2|pow|dladdr|dlclose|dlerror|dlopen|dlsym|__libc_single_threaded|"
                         "_ZSt28__throw_bad_array_new_lengthv|_ZNSt15__exception_ptr13exception_ptr(9_M_addref|10_M_release)Ev|"
                         "pthread_(attr_getstack|attr_setstacksize|cancel|create|detach|"
                         "getaffinity_np|getattr_np|getspecific|join|key_create|key_delete|mutex_clocklock|mutex_trylock|mutexattr_(destroy|init|settype)|"
                         "once|setaffinity_np|setspecific)")
# The newest versions that systems with glibc 2.28 have, and those that the wheel's own libstdc++ has. auditwheel does not tell
# the two libstdc++ apart, so that nothing may ask for versions between them.
NEWEST = {"GLIBC": ("GLIBC_2.2.5", (2, 28), (2, 28)), "GLIBCXX": ("GLIBCXX_3.4", (3, 4, 24), (3, 4, 28)),
          "CXXABI": ("CXXABI_1.3", (1, 3, 11), (1, 3, 12))}


def run(*command, **options):
    ended = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    if ended.returncode:
        raise SystemExit(f"wheel: {Path(command[0]).name} failed:\n{(ended.stdout + ended.stderr)[-4000:]}")
    return ended.stdout


def mirror():
    """Where this machine's apt gets Debian's packages."""
    found = run("apt-get", "indextargets", "--format", "$(REPO_URI)", "Origin: Debian", "Created-By: Packages").split()
    found = [uri for uri in found if "security" not in uri]
    if not found:
        raise SystemExit("wheel: this machine's apt has no source of Debian's packages; expected one named with --mirror")
    return found[0]


def build_root(folder, source=None):
    """Makes the libraries and headers of the older system in folder/root, unless they are there. Needs apt, but not root."""
    root, wanted = folder / "root", " ".join(LIBRARIES + HEADERS)
    if (root / "packages").exists() and (root / "packages").read_text() == wanted:
        return root
    if os.uname().machine != MACHINE:
        raise SystemExit(f"wheel: --portable needs a machine of {MACHINE}, found {os.uname().machine}")
    for tool in ("apt-get", "dpkg-deb"):
        if not shutil.which(tool):
            raise SystemExit(f"wheel: --portable needs {tool}, which was not found")
    if not KEYS.exists():
        raise SystemExit(f"wheel: {KEYS} was not found; expected the package debian-archive-keyring")
    state, made = folder / "apt", folder / "root.part"
    shutil.rmtree(made, ignore_errors=True)
    for name in ("lists/partial", "cache/archives/partial", "etc"):
        (state / name).mkdir(parents=True, exist_ok=True)
    (state / "status").touch()
    source = source or mirror()
    (state / "etc" / "sources.list").write_text(
        "".join(f"deb [arch=amd64 signed-by={KEYS}] {source} {suite} main\n" for suite in ("bullseye", "bookworm", "trixie")))
    options = [f"Dir::State={state}", f"Dir::State::status={state}/status", f"Dir::Cache={state}/cache", f"Dir::Etc={state}/etc",
               "Dir::Etc::SourceParts=/dev/null", "Dir::Etc::PreferencesParts=/dev/null", "APT::Install-Recommends=0",
               "APT::Sandbox::User=root", "APT::Default-Release=bullseye", "APT::Architecture=amd64"]
    apt = ["apt-get", *(part for option in options for part in ("-o", option))]
    archives = state / "cache" / "archives"
    run(*apt, "update")
    run(*apt, "install", "-y", "--download-only", *LIBRARIES)
    run(*apt, "download", *HEADERS, cwd=archives)
    owners = {}
    for package in sorted(archives.glob("*.deb")):
        run("dpkg-deb", "-x", package, made)
        for line in run("dpkg-deb", "-I", package, "md5sums").splitlines():
            owners[line.split(maxsplit=1)[1]] = package.name.split("_")[0]
    (made / "owners.json").write_text(json.dumps({path: name for path, name in owners.items() if ".so" in path}))
    lib = made / FOLDERS[0]
    # Of these the static library, or the headers alone, are wanted.
    for name in ("deflate", "fmt", "stb", "tomlplusplus"):
        for path in lib.glob(f"lib{name}.so*"):
            path.unlink()
    shutil.rmtree(lib / "cmake" / "tomlplusplus")
    for path in (lib / "cmake" / "fmt").iterdir():
        path.unlink()
    (lib / "cmake" / "fmt" / "fmt-config.cmake").write_text("""add_library(fmt::fmt INTERFACE IMPORTED)
set_target_properties(fmt::fmt PROPERTIES INTERFACE_COMPILE_DEFINITIONS FMT_HEADER_ONLY)
""")
    # Embree's CMake file asks for TBB's, which asks for more libraries than are used.
    (lib / "cmake" / "TBB").mkdir()
    (lib / "cmake" / "TBB" / "TBBConfig.cmake").write_text("add_library(TBB::tbb INTERFACE IMPORTED)\n")
    (made / "usr" / "lib" / "include").mkdir(exist_ok=True)  # Debian 11's CMake file of Assimp names it
    for path in made.rglob("*"):
        if path.is_symlink() and os.readlink(path).startswith("/"):
            target = os.path.relpath(str(made) + os.readlink(path), path.parent)
            path.unlink()
            path.symlink_to(target)
    (made / "packages").write_text(wanted)
    shutil.rmtree(root, ignore_errors=True)
    made.rename(root)
    shutil.rmtree(state)
    return root


def owner(library, root):
    """The Debian package that a library is of, if one is."""
    if root != Path("/"):
        return json.loads((root / "owners.json").read_text())[str(library.relative_to(root))]
    for place in (library, "/" + str(library).removeprefix("/usr/")):
        found = subprocess.run(["dpkg-query", "-S", str(place)], capture_output=True, text=True) if shutil.which("dpkg-query") else None
        if found and found.returncode == 0:
            return found.stdout.split(":")[0]
    return None


def copy_headers(folder, python):
    """The tag of a CPython, which is an interpreter or its folder of headers, and a copy of these."""
    include = Path(python)
    if not include.is_dir():
        if not shutil.which(python):
            raise SystemExit(f"wheel: --python {python} was not found; expected a CPython, or its folder of headers")
        include = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_paths()['include'])").strip())
    if not (include / "patchlevel.h").exists():
        raise SystemExit(f"wheel: {include}/patchlevel.h, of {python}, was not found; expected headers (Debian: python3-dev)")
    major, minor = (int(re.search(rf"#define PY_{part}_VERSION\s+(\d+)", (include / "patchlevel.h").read_text())[1])
                    for part in ("MAJOR", "MINOR"))
    other = include.parent / f"{MACHINE}-linux-gnu" / include.name  # where Debian has the half of them
    config = "".join(path.read_text() for path in (include / "pyconfig.h", other / "pyconfig.h") if path.exists())
    free = re.search(r"#define Py_GIL_DISABLED\s+1", config)
    if (major, minor) < (3, 9) or free:
        raise SystemExit(f"wheel: --python {python} is {major}.{minor}{' without GIL' if free else ''}; "
                         "expected a CPython of 3.9 or newer, with GIL")
    made = folder / f"cp{major}{minor}"
    shutil.rmtree(made, ignore_errors=True)
    shutil.copytree(include, made)
    if other.is_dir():
        shutil.copytree(other, made / other.parent.name / include.name)
    return made.name, made


def build_modules(folder, root, pythons):
    """Builds a module for each of the CPythons, {tag: file}, and the engine once."""
    headers = dict(copy_headers(folder / "headers", python) for python in pythons)
    static = run(os.environ.get("CXX", "c++"), "-print-file-name=libstdc++.a").strip()
    lib = folder / "lib"
    lib.mkdir(exist_ok=True)
    # What the linker takes for libstdc++: the older one, and from the newer one what the older one lacks.
    (lib / "libstdc++.so").write_text(f"INPUT({root / FOLDERS[0] / 'libstdc++.so.6'} {static})\n")
    places = [root / name for name in FOLDERS]
    # Before g++'s own folders, which have this machine's.
    first = " ".join(f"-L{place}" for place in places)
    toolchain = folder / "toolchain.cmake"
    toolchain.write_text(f"""set(CMAKE_SYSROOT {root})
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{{PKG_CONFIG_SYSROOT_DIR}} {root})
set(ENV{{PKG_CONFIG_LIBDIR}} {root}/{FOLDERS[0]}/pkgconfig:{root}/usr/share/pkgconfig)
set(CMAKE_MODULE_LINKER_FLAGS_INIT "-s -L{lib} {first} -Wl,--exclude-libs,ALL -Wl,-rpath-link,{places[0]}:{places[1]}")
""")
    build = folder / "build"
    wheels = ";".join(f"{tag}={path}" for tag, path in headers.items())
    run("cmake", "-S", SOURCE, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_TOOLCHAIN_FILE={toolchain}",
        "-DSELDINGER_PYTHON=OFF", "-DSELDINGER_TESTS=OFF", "-DSELDINGER_BENCHMARKS=OFF", f"-DSELDINGER_WHEELS={wheels}",
        env={**os.environ, "CCACHE_DISABLE": "1"})  # which would answer CMake with the folders of another build
    run("cmake", "--build", build, "--target", *(f"core_{tag}" for tag in headers))
    made = {}
    for tag in headers:
        made[tag] = folder / f"_core.cpython-{tag[2:]}-{MACHINE}-linux-gnu.so"
        shutil.copy(build / f"core_{tag}.so", made[tag])
    return made


def fit(file):
    """Lets a library ask for no version of what it asks of a newer glibc or libstdc++, where all of it is in UNVERSIONED or in
    the wheel's libstdc++. Its unique symbols become weak: those of a newer libstdc++ in the process, as NumPy may bring it,
    would take the place of the wheel's, which then reads no number."""
    data = bytearray(file.read_bytes())
    start, = struct.unpack_from("<Q", data, 0x28)
    size, count, names = struct.unpack_from("<HHH", data, 0x3a)
    headers = [struct.unpack_from("<IIQQQQIIQQ", data, start + i * size) for i in range(count)]

    def text(base, at):
        return data[base + at:data.index(b"\0", base + at)].decode()
    sections = {text(headers[names][4], one[0]): one for one in headers}
    if ".gnu.version_r" not in sections:
        return
    strings, symbols = sections[".dynstr"][4], sections[".dynsym"]
    asked, unique, weak = {}, 10, 2
    for i in range(symbols[5] // 24):
        name, kind = struct.unpack_from("<IB", data, symbols[4] + 24 * i)
        if kind >> 4 == unique:
            data[symbols[4] + 24 * i + 4] = weak << 4 | kind & 15
        place = sections[".gnu.version"][4] + 2 * i
        asked.setdefault(struct.unpack_from("<H", data, place)[0] & 0x7fff, {})[text(strings, name)] = place
    at = sections[".gnu.version_r"][4]
    entries = []
    while True:
        _, _, _, first, after = struct.unpack_from("<HHIII", data, at)
        entry = at + first
        while True:
            number, name, step = struct.unpack_from("<HII", data, entry + 6)
            entries.append((entry, number, name, text(strings, name)))
            if not step:
                break
            entry += step
        if not after:
            break
        at += after
    place = {version: name for _, _, name, version in entries}
    for entry, number, _, version in entries:
        library, _, parts = version.partition("_")
        oldest, newest, ours = NEWEST.get(library, (None, None, None))
        asks = oldest in place and tuple(map(int, parts.split(".")))
        if not asks or asks <= newest:
            continue
        if asks <= ours or all(UNVERSIONED.fullmatch(name) for name in asked.get(number, ())):
            for one in asked.get(number, {}).values():
                struct.pack_into("<H", data, one, 0)
            value = 0
            for letter in oldest.encode():
                value = (value << 4) + letter
                high = value & 0xf0000000
                value = (value ^ (high >> 24)) & ~high
            struct.pack_into("<I", data, entry, value & 0xffffffff)
            struct.pack_into("<I", data, entry + 8, place[oldest])
    file.write_bytes(data)
