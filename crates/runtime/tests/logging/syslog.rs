use std::net::UdpSocket;
use std::os::unix::net::UnixDatagram;

use slate_module::Level;
use slate_runtime::log::{LogTarget, Record, SyslogAddress, SyslogTarget};

use crate::logging::{LONG, folder, record};

fn full_record() -> Record {
    let mut full = record("lost\nway");
    full.fields.push(("near to".into(), "door \"3\"]".into()));
    full.dropped = 2;
    full
}

fn received(receive: impl FnOnce(&mut [u8]) -> std::io::Result<usize>) -> String {
    let mut bytes = [0; 2048];
    let count = receive(&mut bytes).unwrap();
    String::from_utf8(bytes[..count].to_vec()).unwrap()
}

#[test]
fn the_local_syslog_gets_lines_as_rfc_3164_has_them() {
    let path = folder("syslog").join("log");
    let socket = UnixDatagram::bind(&path).unwrap();
    socket.set_read_timeout(Some(LONG)).unwrap();
    let mut target = SyslogTarget::new(SyslogAddress::Socket(path), "robot1");
    let process = std::process::id();
    let levels =
        [(Level::Error, 11), (Level::Warn, 12), (Level::Info, 14), (Level::Debug, 15), (Level::Trace, 15)];
    for (level, priority) in levels {
        target.write(&Record { level, ..record("hello") });
        let line = received(|bytes| socket.recv(bytes));
        assert_eq!(line, format!("<{priority}>robot1[{process}]: m: hello"));
    }
    target.write(&full_record());
    let line = received(|bytes| socket.recv(bytes));
    let text = "lost\\nway near to=door \"3\"] (2 lines before this were dropped)";
    assert_eq!(line, format!("<14>robot1[{process}]: m: {text}"));
    assert_eq!(target.diagnostic(), None);
}

#[test]
fn a_server_gets_fields_as_structured_data_of_rfc_5424() {
    let server = UdpSocket::bind("127.0.0.1:0").unwrap();
    server.set_read_timeout(Some(LONG)).unwrap();
    let address = SyslogAddress::Server(server.local_addr().unwrap());
    let mut target = SyslogTarget::new(address, "robot1");
    target.write(&full_record());
    let line = received(|bytes| server.recv(bytes));
    let expected = format!(
        "<14>1 - - robot1 {} - [slate@32473 module=\"m\" time=\"1.5\" dropped=\"2\"]\
         [fields@32473 near_to=\"door \\\"3\\\"\\]\"] lost\nway",
        std::process::id()
    );
    assert_eq!(line, expected);
}

#[test]
fn unreachable_syslog_is_reported_once_and_retried() {
    let path = folder("no-syslog").join("log");
    let mut target = SyslogTarget::new(SyslogAddress::Socket(path.clone()), "robot1");
    for _ in 0..3 {
        target.write(&record("lost"));
    }
    assert!(
        target.diagnostic().unwrap().contains("can't be written, so lines are missing there: No such file")
    );
    assert_eq!(target.diagnostic(), None);
    let socket = UnixDatagram::bind(&path).unwrap();
    target.write(&record("found"));
    assert!(received(|bytes| socket.recv(bytes)).ends_with("m: found"));
    assert!(target.diagnostic().unwrap().ends_with("can be written again; lines missing there: 3"));
}

#[test]
fn hanging_syslog_blocks_no_thread() {
    let path = folder("hung-syslog").join("log");
    let socket = UnixDatagram::bind(&path).unwrap();
    let mut target = SyslogTarget::new(SyslogAddress::Socket(path), "robot1");
    let mut written = 0;
    // Without a reader the system's buffer fills up.
    while target.diagnostic().is_none() {
        target.write(&record(&format!("line {written}")));
        written += 1;
    }
    (0..10_000).for_each(|_| target.write(&record("lost")));
    assert_eq!(target.diagnostic(), None, "said once");
    let mut buffered = 0;
    socket.set_nonblocking(true).unwrap();
    while socket.recv(&mut [0; 2048]).is_ok() {
        buffered += 1;
    }
    assert_eq!(buffered, written - 1);
    target.write(&record("again"));
    assert!(target.diagnostic().unwrap().ends_with("lines missing there: 10001"));
}
