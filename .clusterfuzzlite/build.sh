#!/bin/bash
# Builds the fuzzers for ClusterFuzzLite and OSS-Fuzz, which give CC, CXX, CFLAGS, CXXFLAGS, LIB_FUZZING_ENGINE, SRC, WORK and OUT: programs,
# seeds and shared libraries in OUT.
set -euo pipefail
cd "$SRC/tricoil"
build=$WORK/tricoil
export CXXFLAGS=${CXXFLAGS//-stdlib=libc++/}  # the packages of C++ libraries are compiled with libstdc++
cmake -S . -B "$build" -G Ninja -DTRICOIL_FUZZ=ON -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_INSTALL_RPATH="\$ORIGIN/lib"
ninja -C "$build"
mkdir -p "$OUT/lib"
for program in "$build"/tests/fuzz/*_fuzzer; do
    name=$(basename "$program" _fuzzer)
    cp "$program" "$OUT"
    (cd "tests/fuzz/corpus/$name" && python3 -m zipfile -c "$OUT/${name}_fuzzer_seed_corpus.zip" ./*)
    # The machine that runs the fuzzers has only the C library.
    ldd "$program" | sed -nE 's/.* => (\/\S+) .*/\1/p' | grep -vE '/(ld-|lib(c|m|dl|pthread|rt|gcc_s|stdc\+\+)\.so)' | xargs -r cp -L -t "$OUT/lib"
done
