# Wall and processor time of a script's parts; to be sourced.
LC_NUMERIC=C

# Sets wall_s, and processor_s: what all commands that have ended so far took.
read_clocks() {
    local file
    file=$(mktemp)
    times >"$file"  # not in a pipe: that would be another process, with times of its own
    wall_s=$EPOCHREALTIME
    processor_s=$(awk 'NR == 2 { gsub(/[ms]/, " "); print $1 * 60 + $2 + $3 * 60 + $4 }' "$file")
    rm "$file"
}
