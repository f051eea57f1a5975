#!/bin/sh
# Usage: run_mutations.sh SOURCE_DIR WORK_DIR   (CXX in the environment)
# Copies the core, applies one line of mutations.txt at a time, compiles the known-answer checks with it and requires that they fail. The
# unchanged core must pass. A line whose text does not occur exactly once in its file is an error (stale table). Only the affected units are
# recompiled, without optimisation and in one precision.
set -eu
source_dir=$1
work=$2
table=$(dirname "$0")/mutations.txt
here=$(dirname "$0")

rm -rf "$work"
mkdir -p "$work"

units="base/assertion_host selfcheck/known_answer selfcheck/geometry_checks selfcheck/field_checks selfcheck/solver_checks solver/direct solver/previous_measurement"

# affected FILE: units to recompile when FILE changes
affected() {
    case $1 in
        core/geometry/*) echo selfcheck/geometry_checks ;;
        core/field/*) echo selfcheck/field_checks ;;
        core/solver/pose_covariance.hpp) echo selfcheck/solver_checks ;;
        core/solver/*.cpp) basename "$1" .cpp | sed 's,^,solver/,' ;;
        *) echo "$units" ;;
    esac
}

# compile DIR SOURCE OBJECT
compile() {
    "$CXX" -std=c++20 -O0 -I"$1" -c "$2" -o "$3" 2>> "$1/compiler.log"
}

# check DIR UNITS: 0 if the self-check with these UNITS of DIR/core passes, 1 if it fails, 2 if it does not compile
check() {
    changed=""
    for unit in $2; do
        compile "$1" "$1/core/$unit.cpp" "$1/$(basename "$unit").o" || return 2
        changed="$changed $1/$(basename "$unit").o"
    done
    others=""
    for unit in $units; do
        [ -e "$1/$(basename "$unit").o" ] || others="$others $work/unchanged/$(basename "$unit").o"
    done
    # Link order: the mutated units come first, so that all units use their inline functions.
    "$CXX" $changed $others "$work/main.o" -o "$1/check" 2>> "$1/compiler.log" || return 2
    "$1/check" > "$1/check.log" || return 1
}

# mutate NUMBER FILE FROM TO: prints one line; 0 if caught
mutate() {
    dir=$work/$1
    mkdir -p "$dir"
    cp -r "$work/unchanged/core" "$dir/core"
    replace_once "$dir/$2" "$3" "$4" || { echo "STALE   $1: '$3' is not exactly once in $2"; return 1; }
    status=0
    check "$dir" "$(affected "$2")" || status=$?
    case $status in
        1) echo "caught  $1: $2: $3 -> $4 ($(cat "$dir/check.log"))"; rm -rf "$dir" ;;
        0) echo "MISSED  $1: $2: $3 -> $4"; return 1 ;;
        *) echo "BROKEN  $1: $2: $3 -> $4 does not compile, see $dir/compiler.log"; return 1 ;;
    esac
}

# replace_once FILE FROM TO: literal text, which must be in the file exactly once
replace_once() {
    FROM=$2 TO=$3 awk '
        BEGIN { from = ENVIRON["FROM"]; to = ENVIRON["TO"] }
        { at = index($0, from)
          if (at) { count++; $0 = substr($0, 1, at - 1) to substr($0, at + length(from)); if (index(substr($0, at + length(to)), from)) count++ }
          print }
        END { exit count == 1 ? 0 : 1 }' "$1" > "$1.new" || return 1
    mv "$1.new" "$1"
}

mkdir -p "$work/unchanged"
cp -r "$source_dir/core" "$work/unchanged/core"
sed -i '/^template .*float/d' "$work"/unchanged/core/solver/*.cpp "$work"/unchanged/core/selfcheck/*_checks.cpp  # one precision is enough
compile "$work/unchanged" "$here/known_answers_main.cpp" "$work/main.o"
check "$work/unchanged" "$units" || { echo "the unchanged core does not pass"; cat "$work/unchanged"/*.log; exit 1; }

number=0
failed=0
pending=""
# Two mutations run at a time.
while IFS='|' read -r file from to; do
    case $file in '' | '#'*) continue ;; esac
    number=$((number + 1))
    mutate "$number" "$file" "$from" "$to" &
    pending="$pending $!"
    if [ $((number % 2)) -eq 0 ]; then
        for job in $pending; do wait "$job" || failed=$((failed + 1)); done
        pending=""
    fi
done < "$table"
for job in $pending; do wait "$job" || failed=$((failed + 1)); done
echo "$number mutations, $((number - failed)) caught"
[ "$failed" -eq 0 ] && [ "$number" -ge 20 ]
