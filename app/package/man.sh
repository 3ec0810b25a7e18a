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
# Commands stand in the help as two blanks, a word, blanks, what it does.
for command in $("$program" --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z][a-z-]*\) .*/\1/p'); do
    printf '.SH %s %s\n.nf\n' "$(printf '%s' "$name" | tr a-z A-Z)" "$(printf '%s' "$command" | tr a-z A-Z)"
    "$program" "$command" --help | text
    printf '.fi\n'
done
printf '.SH SEE ALSO\nThe manual in docs/ of the source.\n'
exec >&-
gzip -9nc "$4.new" >"$4"
rm "$4.new"
