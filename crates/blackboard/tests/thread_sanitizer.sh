#!/usr/bin/env bash
# Real threads under ThreadSanitizer, with the stable compiler: tests/threads.rs. Arguments go to cargo, such as
# --features mutant-ordering, which must fail.
set -eu
cd "$(dirname "$0")/../../.."
# A target of its own keeps build scripts and macros free of the sanitizer.
target=$(rustc -vV | sed -n 's/^host: //p')
export RUSTC_BOOTSTRAP=1
export RUSTFLAGS="-Zsanitizer=thread -Cunsafe-allow-abi-mismatch=sanitizer"
export TSAN_OPTIONS="suppressions=$PWD/crates/blackboard/tests/thread-sanitizer.txt halt_on_error=1"
exec cargo test -p slate-blackboard --test threads --target "$target" --target-dir target/thread-sanitizer "$@"
