# Wall and processor time of a script's parts, without a process of its own. To be sourced.
exec {clocks}<> <(:)  # a pipe to this shell itself

# Sets wall_ms, and processor_ms: processor time of all commands that have ended so far.
read_clocks() {
    local user system time unit='([0-9]+)m([0-9]+)[.,]([0-9]{3})s'
    times >&"$clocks"  # not to another command: it would run in a subshell, which has its own times
    read -r _ <&"$clocks"
    read -r user system <&"$clocks"
    wall_ms=$((${EPOCHREALTIME/[.,]/} / 1000))
    processor_ms=0
    for time in "$user" "$system"; do
        [[ $time =~ $unit ]]
        processor_ms=$((processor_ms + 60000 * BASH_REMATCH[1] + 10#${BASH_REMATCH[2]}${BASH_REMATCH[3]}))
    done
}
