#!/bin/sh
# docs/build.sh [PROGRAM]: makes the site of the manual in build/site; open build/site/index.html. Fails where a link, an
# anchor or a picture leads nowhere, in the source (tests/documents.py) or in the site. With PROGRAM, a built seldinger,
# commands are checked as well. Needs the packages mkdocs and mkdocs-material, and no network.
set -eu
cd "$(dirname "$0")/.."
python3 tests/documents.py "$@"
command -v mkdocs >/dev/null || { echo "docs/build.sh: mkdocs was not found: apt-get install mkdocs mkdocs-material" >&2; exit 2; }
# The site has the folders of the repository, with what the pages link to.
source=build/site-source
rm -rf "$source" build/site
mkdir -p "$source"
cp README.md CONTRIBUTING.md CHANGELOG.md LICENSE CITATION.cff "$source"
for folder in docs assets physics tests examples app; do
    find "$folder" -type f ! -name '*.pyc' \( -path 'docs/*' -o -path 'assets/*' -o -path 'examples/*' -o -name '*.md' -o -name '*.sh' -o -name '*.py' -o -name '*.cpp' \) \
        -exec cp --parents {} "$source" \;
done
mkdocs build --strict >build/site.log 2>&1 || { grep -v "^INFO" build/site.log >&2; exit 1; }
python3 docs/check_site.py build/site
printf 'The manual: %s\n' "$PWD/build/site/index.html"
