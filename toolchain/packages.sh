# Installs packages while other commands run, unless sudo would ask for a password. To be sourced.
installing='' installing_logs='' last_set=''

# begin_installing SET...: sets of toolchain/install-deps, one after another, in the background. Ctrl-C ends it too.
begin_installing() {
    [ "$(id -u)" -eq 0 ] || sudo -n true 2>/dev/null || return 0
    installing_logs=$(mktemp -d)
    env --default-signal=INT,QUIT bash -c '
        for set in "${@:2}"; do
            status=0
            toolchain/install-deps "$set" >"$1/$set.log" 2>&1 || status=$?
            echo $status >"$1/$set"
        done' - "$installing_logs" "$@" &
    installing=$!
    last_set=${!#}
}

# end_installing SET: waits until this set is installed; prints what toolchain/install-deps printed, and returns its exit status. Installs
# the set if nothing was begun.
end_installing() {
    [ -n "$installing" ] || { toolchain/install-deps "$1" >&2; return; }
    while [ ! -s "$installing_logs/$1" ] && kill -0 "$installing" 2>/dev/null; do sleep 0.2; done
    [ "$1" != "$last_set" ] || wait "$installing" || true  # its processor time is that of this script
    [ -s "$installing_logs/$1" ] || return 1  # interrupted
    cat "$installing_logs/$1.log" >&2
    return "$(cat "$installing_logs/$1")"
}
