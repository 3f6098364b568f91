//! Builds the plugins that the tests load, each once in a run, and makes damaged copies of them.
#![allow(dead_code, reason = "`plugins_cpp` uses a part of it, and `plugins` the rest")]

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// The libraries: a folder for each version of a plugin, with the library under its usual name.
pub struct Libraries {
    folder: PathBuf,
}

/// Versions of the counter, and the features that make them.
const VERSIONS: [&str; 9] =
    ["more", "unfit", "ports", "unit", "kinds", "describe", "circle", "rogue", "ports,rogue"];

fn tests() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/plugins")
}

/// Set in a process that a test started.
pub const CHILD: &str = "SLATE_TEST_CHILD";

/// The libraries, built on first use.
pub fn libraries() -> &'static Libraries {
    static LIBRARIES: OnceLock<Libraries> = OnceLock::new();
    LIBRARIES.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("plugins");
        fs::create_dir_all(&folder).unwrap();
        // Two runs of the tests at a time take turns.
        let lock = File::create(folder.join("lock")).unwrap();
        lock.lock().unwrap();
        let libraries = Libraries { folder };
        if std::env::var_os(CHILD).is_none() {
            libraries.build();
        }
        libraries
    })
}

impl Libraries {
    /// A version of the counter; `plain` is the first one.
    pub fn counter(&self, version: &str) -> PathBuf {
        self.folder.join(version).join("libcounter.so")
    }

    /// Another plugin.
    pub fn other(&self, name: &str) -> PathBuf {
        self.folder.join("plain").join(format!("lib{name}.so"))
    }

    fn build(&self) {
        let fixtures = tests().join("fixtures");
        // The versions that Slate itself is built with are on this machine for sure.
        fs::copy(tests().join("../../../../Cargo.lock"), fixtures.join("Cargo.lock")).unwrap();
        self.cargo(&["build", "--workspace"], &[]);
        for name in ["counter", "impostor", "dependent", "left", "right", "bare"] {
            self.keep("plain", name);
        }
        for version in VERSIONS {
            self.cargo(&["build", "--package", "counter", "--features", version], &[]);
            self.keep(version, "counter");
        }
        self.cargo(&["rustc", "--package", "counter"], &["--", "-C", "panic=abort"]);
        self.keep("abort", "counter");
        gcc("smoother.c", &[], &self.folder.join("plain/libsmoother.so"));
    }

    fn cargo(&self, first: &[&str], last: &[&str]) {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let output = Command::new(cargo)
            .args(first)
            .args(["--offline", "--quiet", "--manifest-path"])
            .arg(tests().join("fixtures/Cargo.toml"))
            .arg("--target-dir")
            .arg(self.target())
            .args(last)
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_BUILD_TARGET")
            .output()
            .unwrap();
        assert!(output.status.success(), "{first:?}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// Where all plugins of tests are built with the same settings, so that what they need is built once.
    fn target(&self) -> PathBuf {
        self.folder.with_file_name("plugin-target")
    }

    fn keep(&self, version: &str, name: &str) {
        let (folder, file) = (self.folder.join(version), format!("lib{name}.so"));
        fs::create_dir_all(&folder).unwrap();
        // Another run may be reading the old one.
        let new = folder.join("new");
        fs::copy(self.target().join("debug").join(&file), &new).unwrap();
        fs::rename(new, folder.join(&file)).unwrap();
    }
}

/// Builds a plugin in C as its author would.
pub fn gcc(source: &str, more: &[String], library: &Path) {
    let output = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC", "-fvisibility=hidden"])
        .args(more)
        .arg("-I")
        .arg(tests().join("../../../module/include"))
        .arg(tests().join("fixtures").join(source))
        .arg("-o")
        .arg(library)
        .output()
        .expect("gcc is needed for this test");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Where the headers for C and C++ are, and the sources of the plugins.
pub fn header_folder() -> (PathBuf, PathBuf) {
    (tests().join("../../../module/include"), tests().join("fixtures"))
}

/// A folder that goes with the test.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new() -> Self {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("slate-plugin-tests-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// A copy of a library in it.
    pub fn copy(&self, library: &Path) -> PathBuf {
        let copy = self.0.join(library.file_name().unwrap());
        fs::copy(library, &copy).unwrap();
        copy
    }

    /// A file in it with those bytes.
    pub fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let file = self.0.join(name);
        fs::write(&file, bytes).unwrap();
        file
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Where bytes stand in others.
pub fn find(bytes: &[u8], part: &[u8]) -> usize {
    bytes.windows(part.len()).position(|window| window == part).expect("the part is in the file")
}

/// Puts other bytes of the same length in the place of a part.
pub fn patch(bytes: &mut [u8], part: &str, by: &str) {
    assert_eq!(part.len(), by.len());
    let at = find(bytes, part.as_bytes());
    bytes[at..at + by.len()].copy_from_slice(by.as_bytes());
}
