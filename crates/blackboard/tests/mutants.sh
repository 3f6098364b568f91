#!/usr/bin/env bash
# The good code must pass the checkers, and each mutant must be caught by every test named for it.
set -u
cd "$(dirname "$0")/../../.."
failures=0

# check TOOL TEST FEATURES: the exit code of one test.
check() {
    case $1 in
    loom) RUSTFLAGS="--cfg loom" timeout 300 cargo test -q -p slate-blackboard --release --test loom \
        --target-dir target/loom --features "$3" -- --exact $2 ;;
    sanitizer) timeout 300 crates/blackboard/tests/thread_sanitizer.sh --features "$3" ;;
    shuttle) timeout 300 cargo test -q -p slate-blackboard --release --test shuttle \
        --features "shuttle,$3" -- --exact $2 ;;
    esac >/tmp/slate-mutant.$$ 2>&1
}

expect_pass() {
    if check "$1" "" ""; then echo "passes: $1"; else
        echo "FAILS: $1 on the good code"; cat /tmp/slate-mutant.$$; failures=$((failures + 1)); fi
}

expect_caught() { # TOOL MUTANT TESTS...
    local tool=$1 mutant=$2 test
    for test in "${@:3}"; do
        if check "$tool" "$test" "mutant-$mutant"; then
            echo "MISSED: $mutant by $tool $test"; failures=$((failures + 1))
        # A build error is no catch.
        elif grep -qE "ThreadSanitizer: data race|panicked at" /tmp/slate-mutant.$$; then
            echo "caught: $mutant by $tool $test"
        else
            echo "BROKEN: $mutant by $tool $test"; cat /tmp/slate-mutant.$$; failures=$((failures + 1))
        fi
    done
}

expect_pass loom
expect_pass shuttle
expect_pass sanitizer
expect_caught loom ordering \
    loan_is_returned_without_readers \
    queue_loan_is_returned_without_readers \
    a_reader_sees_whole_values_in_order_and_in_the_end_the_last \
    two_readers_see_whole_values_in_order_and_the_last_one \
    an_overtaken_reader_of_a_queue_counts_what_it_lost \
    a_reader_that_blocks_loses_nothing \
    a_snapshot_holds_values_of_one_commit \
    messages_of_two_senders_all_arrive_each_senders_in_order \
    a_message_stays_as_it_is_until_the_receiver_releases_it \
    no_notification_is_lost_and_what_came_before_it_is_seen \
    an_observer_gets_events_whole_and_in_order_or_counts_them
expect_caught loom readers \
    loan_is_returned_without_readers \
    queue_loan_is_returned_without_readers \
    a_reader_sees_whole_values_in_order_and_in_the_end_the_last \
    two_readers_see_whole_values_in_order_and_the_last_one \
    an_overtaken_reader_of_a_queue_counts_what_it_lost
expect_caught loom turns held_value_is_unchanged_after_late_turn
expect_caught loom commit a_snapshot_holds_values_of_one_commit
expect_caught loom events an_observer_gets_events_whole_and_in_order_or_counts_them
expect_caught loom mailbox a_message_stays_as_it_is_until_the_receiver_releases_it
expect_caught loom wake no_notification_is_lost_and_what_came_before_it_is_seen
expect_caught shuttle readers \
    a_reader_outlives_writers_and_tells_their_generations \
    readers_come_and_go_while_a_writer_writes \
    outputs_of_late_step_reach_no_reader
expect_caught shuttle events events_tell_what_comes_and_goes_while_all_comes_and_goes
expect_caught shuttle wake no_notification_is_lost_when_the_waiting_thread_changes
expect_caught sanitizer ordering threads
expect_caught sanitizer readers threads

rm -f /tmp/slate-mutant.$$
[ "$failures" = 0 ] && echo "all mutants caught" || { echo "$failures failures"; exit 1; }
