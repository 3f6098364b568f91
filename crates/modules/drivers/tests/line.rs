//! Lines and their addresses.

use slate_device_line::{Backoff, DeviceLine, LineAddress, PortError};
use slate_drivers::simulated::{SimulatedHokuyo, SimulatedLine};
use std::time::Duration;

use crate::common::{at_terminal, unique};

#[test]
fn an_address_is_a_path_or_a_host_with_a_port() {
    let parse = |text: &str| LineAddress::parse(text, 9600, 10940);
    assert_eq!(parse("/dev/ttyS0"), Ok(LineAddress::Serial { path: "/dev/ttyS0".into(), baud: 9600 }));
    assert_eq!(parse("tcp://laser"), Ok(LineAddress::Tcp("laser:10940".into())));
    assert_eq!(parse("tcp://10.0.0.2:99"), Ok(LineAddress::Tcp("10.0.0.2:99".into())));
    assert_eq!(parse("tcp://[::1]:99"), Ok(LineAddress::Tcp("[::1]:99".into())));
    assert_eq!(parse("tcp://[::1]"), Ok(LineAddress::Tcp("[::1]:10940".into())));
    for wrong in [
        "",
        "ttyS0",
        "tcp://",
        "tcp://:5",
        "tcp://host:port",
        "tcp://host:0",
        "tcp://host:70000",
        "udp://host",
    ] {
        let error = parse(wrong).unwrap_err().to_string();
        assert!(error.contains("expected") && error.contains(&format!("\"{wrong}\"")), "{error}");
    }
}

#[test]
fn lines_that_are_none_are_refused_in_words() {
    let open = |address: LineAddress| DeviceLine::open(&address).unwrap_err();
    let missing = unique("missing");
    assert_eq!(
        open(LineAddress::Serial { path: missing.clone(), baud: 9600 }),
        PortError::Missing(missing.clone())
    );
    assert_eq!(open(LineAddress::Input(missing.clone())), PortError::Missing(missing));
    let null = LineAddress::Serial { path: "/dev/null".into(), baud: 9600 };
    assert_eq!(open(null), PortError::NotSerial("/dev/null".into()));
    // A port that was free a moment ago.
    let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let error = open(LineAddress::Tcp(port.to_string())).to_string();
    assert!(error.contains("no connection to 127.0.0.1") && error.contains("power"), "{error}");
    // A driver has it already.
    let device = at_terminal(SimulatedHokuyo::default());
    let address = LineAddress::Serial { path: device.name().into(), baud: 9600 };
    let _first = DeviceLine::open(&address).unwrap();
    assert_eq!(open(address), PortError::Busy(device.name().into()));
}

#[test]
fn pauses_double_up_to_a_limit_and_begin_again() {
    let mut backoff = Backoff::new(Duration::from_millis(100), Duration::from_millis(350));
    let pauses: Vec<u128> = (0..4).map(|_| backoff.fail().as_millis()).collect();
    assert_eq!(pauses, [100, 200, 350, 350]);
    backoff.succeed();
    assert_eq!(backoff.fail().as_millis(), 100);
}

#[test]
fn a_device_without_a_link_can_not_be_plugged_in_again() {
    use slate_drivers::simulated::SimulatedDevice;
    let device = SimulatedDevice::start(SimulatedHokuyo::default(), SimulatedLine::Terminal(None)).unwrap();
    device.unplug();
    assert!(device.plug().unwrap_err().to_string().contains("without a link"));
}
