#!/bin/sh
# package.sh BUILD SOURCE: makes the Debian package of the build folder, unpacks it, and runs what is in it from elsewhere,
# without the source's assets. Fails where something that the programs need is not installed.
set -eu
build=$1
source=$2
fail() {
    printf 'package: %s\n' "$1" >&2
    exit 1
}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
unset SELDINGER_ASSETS

(cd "$build" && cpack -G DEB -B "$scratch/made") >cpack.log 2>&1 || { cat cpack.log >&2; fail "cpack failed"; }
dpkg-deb -x made/*.deb root
bin=$scratch/root/usr/bin
share=$scratch/root/usr/share/seldinger
[ ! -L "$share" ] || fail "$share is a link"

# All assets are there, byte for byte; the pictures are the README's.
diff -r --exclude=pictures "$source/assets" "$share" >&2 || fail "assets differ from those of the source"
for document in README.md CHANGELOG.md copyright changelog.gz; do
    [ -f "$scratch/root/usr/share/doc/seldinger/$document" ] || fail "$document is missing"
done

for page in seldinger seldinger-study; do
    gzip -dc "$scratch/root/usr/share/man/man1/$page.1.gz" | grep -q '^.SH SYNOPSIS' || fail "the manual page of $page is missing"
done
for file in bash-completion/completions/seldinger zsh/site-functions/_seldinger fish/vendor_completions.d/seldinger.fish; do
    grep -q -- truth-of "$scratch/root/usr/share/$file" || fail "$file does not complete options"
done
if command -v lintian >/dev/null 2>&1; then
    lintian --fail-on error,warning made/*.deb >lintian.txt 2>&1 || { cat lintian.txt >&2; fail "lintian finds faults"; }
fi

# What is in the programs, and under which licences: a library that is loaded, one that is linked, one of headers alone.
sbom=$scratch/root/usr/share/doc/seldinger/sbom.spdx.json
for package in libembree3-3 libssl3 libimgui-dev libeigen3-dev; do
    dpkg-query -W "$package" >/dev/null 2>&1 || continue
    grep -q "\"name\": \"$package\", \"versionInfo\": \"$(dpkg-query -W -f '${Version}' "$package")\"" "$sbom" || fail "the list of packages lacks $package"
done
if command -v python3 >/dev/null 2>&1; then
    python3 - "$sbom" <<'EOF' || fail "the list of packages is not whole"
import json, sys
listed = json.load(open(sys.argv[1]))
names = [package["SPDXID"] for package in listed["packages"]]
assert listed["spdxVersion"] == "SPDX-2.3" and len(names) == len(set(names)) > 20
known = {*names, "SPDXRef-DOCUMENT"}
assert all({one["spdxElementId"], one["relatedSpdxElement"]} <= known for one in listed["relationships"])
EOF
fi
for package in libimgui-dev libeigen3-dev; do
    gzip -dc "$scratch/root/usr/share/doc/seldinger/third-party-licences.gz" | grep -qx "==== $package ====" || fail "the licence of $package is missing"
done
for program in "$bin"/*; do
    readelf -dl "$program" >linked.txt
    grep -q BIND_NOW linked.txt && grep -q GNU_RELRO linked.txt || fail "$program is linked without BIND_NOW or RELRO"
done

version=$("$bin/seldinger" --version)
[ "seldinger $(dpkg-deb -f made/*.deb Version)" = "$version" ] || fail "'$version' is not the package's version"
grep -m 1 '^## [0-9]' "$source/CHANGELOG.md" | grep -q "^## ${version#seldinger } – " || fail "CHANGELOG.md has no '$version'"

"$bin/seldinger" list >list.txt
for scenario in "$source"/assets/scenarios/*.toml; do
    [ "$(basename "$scenario")" = benchmark.toml ] || grep -q "^$(basename "$scenario" .toml) " list.txt || fail "'list' lacks $(basename "$scenario" .toml)"
done

# The same attempt by the built program and by the installed one: the same states.
run() {
    code=0
    "$1/seldinger" run s_bend --commands "$share/scripts/s_bend.gw" --out "$2" --frames none >"$2.txt" 2>&1 || code=$?
    [ "$code" -le 1 ] || { cat "$2.txt" >&2; fail "run by $1 ended with $code"; }
    grep '^state ' "$2/run.gw" | tail -n 1
}
built=$(run "$build/bin" built)
installed=$(run "$bin" installed)
[ -n "$built" ] || fail "the recording holds no state"
[ "$built" = "$installed" ] || fail "last states differ: built '$built', installed '$installed'"

# The Python module, where it was built: the same states once more.
module=$scratch/root/usr/lib/python3/dist-packages
if [ -d "$module/seldinger" ]; then
    dpkg-deb -f made/*.deb Depends | grep -q python3-numpy || fail "python3-numpy is not asked for"
    hash=$(PYTHONPATH=$module PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -c "
import seldinger as sd
assert str(sd.assets()) == '$share', sd.assets()
sim = sd.Simulation('s_bend', cache='')
for line in open('$scratch/built/run.gw'):
    word = line.split()
    if word[0].isdigit():
        while sim.state.frame + 1 < int(word[0]): sim.step()
        if word[1] != 'end': sim.apply(line.split(None, 1)[1].strip())
sim.step()
print(f'state {sim.state.frame} {sim.state.hash:016x}')") || fail "the Python module fails"
    [ "$hash" = "$built" ] || fail "last states differ: built '$built', Python's '$hash'"
fi

# `study` starts the studies' own program, from the package.
"$bin/seldinger" study >studies.txt
grep -q '^accuracy ' studies.txt || fail "'study' does not list the studies"
"$bin/seldinger" study --help | grep -q -- --shard || fail "'study --help' is not that of seldinger-study"
