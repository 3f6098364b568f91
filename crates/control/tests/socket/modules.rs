//! Modules: their documentation.

use super::*;

#[test]
fn module_is_described_with_its_ports_and_parameters() {
    let (_agent, _server, mut client) = open("describe");
    let teller = client.describe("teller").unwrap();
    assert!(teller.doc.starts_with("Tells its parameters"), "{teller:?}");
    let port = |index: usize| {
        let port = &teller.ports[index];
        (&*port.name, &*port.direction, &*port.interface)
    };
    assert_eq!(port(0), ("told", "Output", "Pair"));
    assert_eq!(port(2), ("input", "Input", "Number"));
    assert_eq!(teller.ports[0].doc, "Two numbers that belong together.", "that of the interface");
    let first = &teller.parameters[0];
    assert_eq!((&*first.name, &*first.unit, &*first.doc), ("first", "m", "told first"));
}
