//! Python and Node for tests with external programs.
//! Each has packages in a folder of its own.
//!
//! The first test that requests packages installs them, from PyPI or npm; later ones find them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

mod hostile;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, MutexGuard, PoisonError};

pub use hostile::{HostileSender, PacketCapture, resident_memory, values_alone};

/// Runs a command to its end.
///
/// # Panics
/// It fails; the message has `advice`, the command and its output.
#[track_caller]
pub fn run(command: &mut Command, advice: &str) -> Output {
    match command.output() {
        Ok(output) if output.status.success() => output,
        Ok(output) => panic!(
            "{advice}\n{command:?}\n{}\n{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        ),
        Err(error) => panic!("{advice}\n{command:?}: {error}"),
    }
}

/// Returns the virtual environment in `folder` with these packages of PyPI.
/// Its programs are in `bin`.
///
/// # Panics
/// Python lacks virtual environments, or PyPI is not reached.
pub fn virtual_environment(folder: &Path, packages: &[&str]) -> PathBuf {
    let _installing = one_at_a_time();
    let python = folder.join("bin/python");
    let works =
        || Command::new(&python).arg("--version").output().is_ok_and(|output| output.status.success());
    if is_complete(folder, packages) && works() {
        return folder.into();
    }
    run(
        Command::new("python3").args(["-m", "venv", "--clear"]).arg(folder),
        "this test needs Python with virtual environments: apt-get install python3-venv",
    );
    run(
        Command::new(&python)
            .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"])
            .args(packages),
        "this test needs packages of PyPI, so it needs a network the first time",
    );
    complete(folder, packages);
    folder.into()
}

/// Returns the Python of a [virtual environment](virtual_environment).
pub fn python(folder: &Path, packages: &[&str]) -> PathBuf {
    virtual_environment(folder, packages).join("bin/python")
}

/// Packages of PyPI: a build of ROS 2 Kilted with rclpy and Fast DDS.
const ROS2: [&str; 11] = [
    "ros-rclpy==9.1.2",
    "ros-rcl==10.1.3",
    "ros-rmw-fastrtps-cpp==9.3.3",
    "ros-rmw-implementation==3.0.4",
    "ros-fastdds==3.2.3",
    "ros-std-msgs==5.5.1",
    "ros-geometry-msgs==5.5.1",
    "ros-sensor-msgs==5.5.1",
    "ros-nav-msgs==5.5.1",
    "ros-std-srvs==5.5.1",
    "ros-test-msgs==2.3.0",
];

/// Returns a Python that has ROS 2, in a folder of a target's temporary ones.
///
/// # Panics
/// As [`virtual_environment`].
pub fn ros2_python(temporary: &Path) -> PathBuf {
    python(&temporary.join("ros2-python"), &ROS2)
}

/// Packages of PyPI: Zenoh, and an implementation of the wire of `rmw_zenoh`.
const ZENOH_ROS2: [&str; 4] =
    ["eclipse-zenoh==1.10.2", "zenoh-ros2-sdk==0.1.8", "rosbags==0.11.9", "xxhash==3.6.0"];

/// Returns a Python with Zenoh and ROS 2 nodes on it.
/// It is in a folder of a target's temporary ones.
///
/// # Panics
/// As [`virtual_environment`].
pub fn zenoh_ros2_python(temporary: &Path) -> PathBuf {
    python(&temporary.join("zenoh-ros2-python"), &ZENOH_ROS2)
}

/// Returns the folder once it has these packages of npm, in `node_modules`.
///
/// # Panics
/// npm is missing, or its registry is not reached.
pub fn node_packages(folder: &Path, packages: &[&str]) -> PathBuf {
    let _installing = one_at_a_time();
    if is_complete(folder, packages) {
        return folder.into();
    }
    // A folder that is not there yet is as good.
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).unwrap();
    fs::write(folder.join("package.json"), "{\"private\": true}").unwrap();
    run(
        Command::new("npm").args(["install", "--silent"]).args(packages).current_dir(folder),
        "this test needs Node (apt-get install nodejs npm), and a network the first time",
    );
    complete(folder, packages);
    folder.into()
}

/// Set in the namespace of a test.
const INSIDE: &str = "SLATE_TEST_NAMESPACE";

/// Runs a test of that path in a network namespace of its own.
/// `prepare` runs before, outside of it, as it has no network: domains of others are not seen there. Where the kernel
/// permits no namespace, the test runs in a domain that hardly anybody uses.
///
/// # Panics
/// The test fails.
pub fn alone(test: &str, prepare: impl FnOnce(), body: impl FnOnce(u16)) {
    if std::env::var_os(INSIDE).is_some() {
        return body(7);
    }
    const LOOPBACK: &str =
        "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo && exec \"$@\"";
    let can =
        Command::new("unshare").args(["-n", "ip", "link"]).output().is_ok_and(|done| done.status.success());
    if !can {
        return body(40 + (std::process::id() % 60) as u16);
    }
    prepare();
    let done = Command::new("unshare")
        .args(["-n", "bash", "-c", LOOPBACK, "test"])
        .arg(std::env::current_exe().unwrap())
        .args([test, "--exact", "--nocapture", "--test-threads=1"])
        .env(INSIDE, "1")
        .output()
        .unwrap();
    let output = String::from_utf8_lossy(&done.stdout) + String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && output.contains("1 passed"), "{output}");
}

/// Tests run beside each other, and each folder is filled once.
fn one_at_a_time() -> MutexGuard<'static, ()> {
    static INSTALLING: Mutex<()> = Mutex::new(());
    INSTALLING.lock().unwrap_or_else(PoisonError::into_inner)
}

fn is_complete(folder: &Path, packages: &[&str]) -> bool {
    fs::read_to_string(folder.join("packages")).is_ok_and(|found| found == packages.join("\n"))
}

fn complete(folder: &Path, packages: &[&str]) {
    fs::write(folder.join("packages"), packages.join("\n")).unwrap();
}
