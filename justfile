# Tasks of the project (https://just.systems). CONTRIBUTING.md has each command in full.

# Lists the tasks.
default:
    @just --list

# Builds the command and runs the first experiment.
run *options:
    cargo run --release -- run exp1 {{options}}

# All tests with default features, as in the README.
test:
    cargo test

# Fast checks before a commit: format and lints.
check:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings

# All checks of the project.
ci:
    .ci/run

# API reference and book, in target/documentation.
docs:
    .ci/docs

# Licenses, advisories and sources of dependencies.
deny:
    cargo deny check

# A file per package, as the registry receives it.
package:
    cargo package --workspace --exclude slate-fuzz --exclude slate-python

# The wheel for Python, in python/target/wheels.
wheel:
    python/build
