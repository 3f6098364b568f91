//! Passes the folder of Copper's log texts and the compiler's version to the code.
//! Copper's macros require the folder.

fn main() {
    let value = |name: &str| std::env::var(name).unwrap_or_default();
    println!("cargo:rustc-env=LOG_INDEX_DIR={}", value("OUT_DIR"));
    let version = std::process::Command::new(value("RUSTC")).arg("--version").output();
    let version = version.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    println!("cargo:rustc-env=RUSTC_VERSION={}", version.unwrap_or_default());
    println!("cargo:rerun-if-changed=build.rs");
}
