//! End of the processes when their host is killed.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::Test;
use crate::faults::{self, watch};

pub const TESTS: [Test; 1] = [("a process ends with its host, also in an endless loop", ends_with_its_host)];

const HOST: &str = "--be-a-host";

/// Where this program is started to be killed.
pub fn enter() {
    if std::env::args().nth(1).as_deref() != Some(HOST) {
        return;
    }
    let fault = std::env::args().nth(2).unwrap();
    let text = faults::text(&fault, 5, "").replace("1s", "60s");
    let mut agent = faults::agent(&text);
    let mut said = false;
    watch(&mut agent, move |sample| {
        if sample.number > 20 && !said {
            said = true;
            println!("{}", sample.process);
        }
        false
    });
}

fn ends_with_its_host() {
    for fault in ["", "endless loop"] {
        let mut host = Command::new(std::env::current_exe().unwrap())
            .args([HOST, fault])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(host.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let process = format!("/proc/{}", line.trim());
        assert!(Path::new(&process).exists(), "{process}");
        host.kill().unwrap();
        host.wait().unwrap();
        let start = Instant::now();
        while is_running(&process) {
            assert!(start.elapsed() < Duration::from_secs(10), "{process} outlives its host");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

/// Whether it does anything: one that has ended may wait for long to be looked after.
fn is_running(process: &str) -> bool {
    let status = std::fs::read_to_string(format!("{process}/status")).unwrap_or_default();
    status.lines().any(|line| line.starts_with("State:") && !line.contains('Z'))
}
