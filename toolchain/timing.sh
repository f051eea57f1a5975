# Wall and processor time of a script's parts. To be sourced.
LC_NUMERIC=C

# Sets wall_s, and processor_s: processor time of all commands that have ended so far.
read_clocks() {
    local file
    file=$(mktemp)
    times >"$file"  # not in a pipe: a pipe runs in a subshell, which has its own times
    wall_s=$EPOCHREALTIME
    processor_s=$(awk 'NR == 2 { gsub(/[ms]/, " "); print $1 * 60 + $2 + $3 * 60 + $4 }' "$file")
    rm "$file"
}
