//! Links the example, which isn't a program of libFuzzer, with its flags.

fn main() {
    // It is never run so: what counts branches is in libFuzzer alone.
    if std::env::var_os("CARGO_CFG_FUZZING").is_some() {
        println!("cargo::rustc-link-arg-examples=-Wl,--unresolved-symbols=ignore-all");
    }
    println!("cargo::rerun-if-changed=build.rs");
}
