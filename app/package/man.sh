#!/bin/sh
# man.sh PROGRAM SUMMARY VERSION FILE: writes the manual page of a program, made of what its --help and its commands' say,
# compressed as Debian wants it.
set -eu
program=$1
name=$(basename "$program")
exec >"$4.new"
text() { sed 's/\\/\\e/g; s/^\([.'"'"']\)/\\\&\1/; s/-/\\-/g'; }
printf '.TH %s 1 "" "Seldinger %s" "User commands"\n.SH NAME\n%s \\- %s\n.SH SYNOPSIS\n.B %s\n[COMMAND] [OPTION]...\n.SH DESCRIPTION\n.nf\n' \
    "$(printf '%s' "$name" | tr a-z A-Z)" "$3" "$name" "$2" "$name"
"$program" --help | text
printf '.fi\n'
# Writes what the help of the commands below these words says. They stand after the options, as two blanks, a word, and
# then more blanks or the line's end.
pages_below() {
    "$program" "$@" --help | grep -q '^Usage: .* COMMAND ' || return 0
    for below in $("$program" "$@" --help | sed -n '/^Options:/,$s/^  \([a-z][a-z]*\)\(  .*\)*$/\1/p'); do
        printf '.SH %s\n.nf\n' "$(printf '%s' "$name $* $below" | tr -s ' ' | tr a-z A-Z)"
        "$program" "$@" "$below" --help | text
        printf '.fi\n'
        pages_below "$@" "$below"
    done
}
pages_below
printf '.SH SEE ALSO\nThe manual in docs/ of the source.\n'
exec >&-
gzip -9nc "$4.new" >"$4"
rm "$4.new"
