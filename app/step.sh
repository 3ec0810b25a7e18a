# Read by app/build.sh and app/web.sh: step COMMAND... runs it with its output in $log, shown only where it fails.
step() {
    if ! "$@" >"$log" 2>&1; then
        tail -n 40 "$log" >&2
        printf '%s: %s failed; the whole log is in %s\n' "$(basename "$0" .sh)" "$1 $2" "$log" >&2
        exit 1
    fi
}
