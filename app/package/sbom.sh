#!/bin/sh
# sbom.sh ROOT BUILD VERSION FILE...: writes ROOT/share/doc/seldinger/sbom.spdx.json (SPDX 2.3): every Debian package of which
# something was compiled into the programs, which is told by the headers that ninja has noted, and those of the FILES, libraries
# and fonts that they load. The licences of the former are put into third-party-licences.gz beside it. All is dpkg's, without network.
set -eu
root=$1
build=$2
version=$3
shift 3
doc=$root/share/doc/seldinger
mkdir -p "$doc"
command -v dpkg-query >/dev/null 2>&1 || { printf 'sbom: expected dpkg, found none: no list of packages is made\n' >&2; exit 0; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# The packages that the files named on standard input are of. With merged /usr, dpkg may know either name of a file.
owners() {
    sort -u | sed -n 's|^/usr\(/lib.*\)|&\n\1|p; t; s|^/lib.*|&\n/usr&|p; t; p' | xargs -r dpkg-query -S 2>/dev/null |
        sed -n 's|^\([^ ,]*\): /.*|\1|p' | sed 's/:.*//' | sort -u || true
}
# ninja -t deps: a line "OBJECT: #deps ...", then a header each, indented.
ninja -C "$build" -t deps 2>/dev/null |
    awk '/^[^ ]/ { ours = $0 ~ /^CMakeFiles\/(physics|render|engine|studies|window|seldinger|seldinger-study|python_core)\.dir\// }
         /^ / && ours && $1 ~ /^\/usr\// { print $1 }' | owners >"$scratch/compiled"
[ -s "$scratch/compiled" ] || { printf 'sbom: expected the headers that ninja notes in %s, found none\n' "$build" >&2; exit 1; }
for file in "$@"; do printf '%s\n' "$file"; done | owners >"$scratch/loaded"

when=$(date -u -d "@${SOURCE_DATE_EPOCH:-$(date +%s)}" +%Y-%m-%dT%H:%M:%SZ)
sum=$(cat "$scratch/compiled" "$scratch/loaded" | xargs dpkg-query -W | sha256sum | cut -c1-32)
relation() {
    for package in $(cat "$1"); do
        printf ',\n    {"spdxElementId": "SPDXRef-%s", "relationshipType": "%s", "relatedSpdxElement": "SPDXRef-seldinger"}' \
            "$(printf '%s' "$package" | tr + .)" "$2"
    done
}
{
    printf '{\n  "spdxVersion": "SPDX-2.3",\n  "dataLicense": "CC0-1.0",\n  "SPDXID": "SPDXRef-DOCUMENT",\n  "name": "seldinger-%s",\n' "$version"
    printf '  "documentNamespace": "https://seldinger.invalid/spdx/seldinger-%s-%s",\n' "$version" "$sum"
    printf '  "creationInfo": {"created": "%s", "creators": ["Tool: seldinger-sbom.sh"]},\n  "packages": [\n' "$when"
    printf '    {"SPDXID": "SPDXRef-seldinger", "name": "seldinger", "versionInfo": "%s", "downloadLocation": "NOASSERTION", "filesAnalyzed": false, "licenseConcluded": "MIT", "licenseDeclared": "MIT", "copyrightText": "2026 The Seldinger authors"}' "$version"
    sort -u "$scratch/compiled" "$scratch/loaded" | xargs dpkg-query -W -f '${Package}\t${Version}\t${Architecture}\t${source:Package}\t${source:Version}\t${Homepage}\n' |
        while IFS='	' read -r package number architecture source source_number homepage; do
            printf ',\n    {"SPDXID": "SPDXRef-%s", "name": "%s", "versionInfo": "%s", "supplier": "Organization: Debian", "downloadLocation": "NOASSERTION", "filesAnalyzed": false, "licenseConcluded": "NOASSERTION", "licenseDeclared": "NOASSERTION", "licenseComments": "/usr/share/doc/%s/copyright", "copyrightText": "NOASSERTION", "sourceInfo": "%s %s", ' \
                "$(printf '%s' "$package" | tr + .)" "$package" "$number" "$package" "$source" "$source_number"
            [ -z "$homepage" ] || printf '"homepage": "%s", ' "$homepage"
            printf '"externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": "pkg:deb/debian/%s@%s?arch=%s"}]}' \
                "$(printf '%s' "$package" | sed 's/+/%2B/g')" "$(printf '%s' "$number" | sed 's/+/%2B/g; s/:/%3A/g; s/~/%7E/g')" "$architecture"
        done
    printf '\n  ],\n  "relationships": [\n    {"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": "SPDXRef-seldinger"}'
    relation "$scratch/compiled" BUILD_DEPENDENCY_OF
    relation "$scratch/loaded" RUNTIME_DEPENDENCY_OF
    printf '\n  ]\n}\n'
} >"$doc/sbom.spdx.json"

for package in $(cat "$scratch/compiled"); do
    printf '==== %s ====\n\n' "$package"
    cat "/usr/share/doc/$package/copyright" 2>/dev/null || printf 'Debian has no statement of it.\n'
    printf '\n'
done | gzip -9nc >"$doc/third-party-licences.gz"
chmod 644 "$doc/sbom.spdx.json" "$doc/third-party-licences.gz"
