//! Files in PNML.

use proptest::prelude::*;
use slate_petri_net::{PetriNet, parse_pnml, read_pnml, write_pnml};

use crate::common::net;

/// A plan in the shape in which the editor of PNP writes one.
const SENSE: &str = r##"<?xml version="1.0" encoding="ISO-8859-1"?>
<pnml>
  <!--generator: an editor-->
  <net id="n1" type="PTNet">
    <name><value>P/T net</value></name>
    <place id="p1">
      <graphics><position x="10" y="20" /></graphics>
      <name><value>init</value><graphics><offset x="5" y="-22" /></graphics></name>
      <initialMarking><value>Default,1</value></initialMarking>
      <toolspecific tool="editor" version="1"><value>7</value></toolspecific>
    </place>
    <place id="p2"><name><value>look.exec</value></name><initialMarking><value>0</value></initialMarking></place>
    <place id="p3"><name><value> </value></name></place>
    <place id="p4"><name><value>goal</value></name></place>
    <transition id="t1"><name><value>look.start</value></name></transition>
    <transition id="t2"><name><value>look.end [not obstacle]</value></name></transition>
    <transition id="t3"><name><value>look.end [obstacle]</value></name></transition>
    <arc id="a1" source="p1" target="t1"><inscription><value>1</value></inscription></arc>
    <arc id="a2" source="t1" target="p2"><inscription><value>Default,1</value></inscription></arc>
    <arc id="a3" source="p2" target="t2" />
    <arc id="a4" source="t2" target="p3" />
    <arc id="a5" source="p2" target="t3" />
    <arc id="a6" source="t3" target="p4"><inscription><value>2</value></inscription></arc>
  </net>
</pnml>
"##;

fn parse(text: &str) -> Result<PetriNet, String> {
    parse_pnml("sense", text.as_bytes()).map_err(|error| error.to_string())
}

#[test]
fn a_file_of_the_editor_has_its_net() {
    let net = parse(SENSE).unwrap();
    assert_eq!(net.name(), "sense");
    assert_eq!(net.initial_marking(), [1, 0, 0, 0]);
    assert_eq!(net.actions(), ["look"]);
    assert_eq!(net.conditions(), ["obstacle"]);
    assert_eq!(net.transitions()[2].outputs, [(3, 2)]);
    let guard = net.transitions()[1].guard.as_ref().unwrap();
    assert_eq!(net.guard_text(guard), "(not obstacle)");
    assert_eq!(net.places()[2].title(), "p3");
}

#[test]
fn a_net_is_read_as_it_was_written() {
    let net = parse(SENSE).unwrap();
    assert_eq!(parse_pnml("another", write_pnml(&net).as_bytes()).unwrap(), net);
}

#[test]
fn latin_letters_are_read_where_the_file_declares_them() {
    let mut bytes = SENSE.as_bytes().to_vec();
    let at = SENSE.find("init<").unwrap();
    bytes[at] = 0xe4;
    assert_eq!(parse_pnml("x", &bytes).unwrap().places()[0].name, "\u{e4}nit");
    let error = parse_pnml("x", &bytes[SENSE.find("<pnml").unwrap()..]).unwrap_err();
    assert!(error.to_string().contains("line 7: expected UTF-8"), "{error}");
}

#[test]
fn the_name_is_that_of_the_file_or_of_a_comment() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("pnml-names");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("patrol.v2.pnml");
    std::fs::write(&file, SENSE).unwrap();
    assert_eq!(read_pnml(&file).unwrap().name(), "patrol");
    std::fs::write(&file, SENSE.replace("<!--generator: an editor-->", "<!-- PLAN NAME: rounds -->"))
        .unwrap();
    assert_eq!(read_pnml(&file).unwrap().name(), "rounds");
    std::fs::write(&file, "<pnml><net></pnml>").unwrap();
    let error = read_pnml(&file).unwrap_err();
    assert!(error.to_string().contains("patrol.v2.pnml:1: expected XML"), "{error}");
    assert!(read_pnml(&folder.join("none.pnml")).unwrap_err().to_string().contains("can't be read"));
}

#[test]
fn a_defect_is_named_with_its_line_and_what_was_expected() {
    let cases = [
        ("target=\"t1\"", "target=\"t9\"", "line 18: the arc's target is `t9`, expected the id of a place"),
        ("target=\"t1\"", "target=\"p2\"", "line 18: expected an arc between a place and a transition"),
        ("source=\"t1\" ", "", "line 19: expected the attribute `source` of `arc`"),
        ("id=\"p3\"", "id=\"p2\"", "line 13: expected a new id, found `p2` a second time"),
        ("<value>2</value>", "<value>0</value>", "line 23: expected an arc's weight of at least 1"),
        ("<value>2</value>", "<value>two</value>", "line 23: expected a number of tokens in `inscription`"),
        ("Default,1</value></initial", "-1</value></initial", "line 9: expected a number of tokens in"),
        ("[not obstacle]", "[not]", "line 16: transition `t2`: expected a condition"),
        (">goal<", ">goal(x)<", "line 14: place `p4`: expected a number of tokens such as `goal(2)`"),
        ("<net ", "<work ", "expected XML"),
    ];
    for (from, to, expected) in cases {
        let text = SENSE.replacen(from, to, 1);
        assert_ne!(text, SENSE);
        let error = parse(&text).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    assert_eq!(parse("<plan/>").unwrap_err(), "line 1: expected the root element `pnml`, found `plan`");
    assert!(parse("<pnml/>").unwrap_err().contains("expected an element `net`"));
    let bomb = "<!DOCTYPE a [<!ENTITY b \"c\">]><pnml><net>&b;</net></pnml>";
    assert!(parse(bomb).unwrap_err().contains("expected XML"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn mutated_files_never_panic(
        cuts in prop::collection::vec((0..SENSE.len(), 0usize..40, any::<prop::sample::Index>(), 0usize..40), 1..6),
    ) {
        let mut bytes = SENSE.as_bytes().to_vec();
        for (at, length, from, count) in cuts {
            let at = at.min(bytes.len());
            let end = (at + length).min(bytes.len());
            let source = from.index(SENSE.len());
            let piece = SENSE.as_bytes()[source..(source + count).min(SENSE.len())].to_vec();
            bytes.splice(at..end, piece);
        }
        if let Ok(net) = parse_pnml("mutant", &bytes) {
            prop_assert_eq!(parse_pnml("mutant", write_pnml(&net).as_bytes()).unwrap(), net);
        }
    }

    #[test]
    fn any_label_is_read_or_refused(label in "[a-c._ ()\\[\\]*0-9]{0,24}|(a\\.exec|goal|fail|ex\\.a| |b\\.end|\\[a\\]|\\(3\\)){0,6}") {
        let text = SENSE.replacen(">look.start<", &format!(">{label}<"), 1).replacen(">init<", &format!(">{label}<"), 1);
        let _ = parse(&text);
    }
}

#[test]
fn a_net_with_any_label_is_written_so_that_it_is_read() {
    let net = net("quote\" & -- <x>", &[("a<b>&\"'c", 2)], &[("x > y [a&b]", &[0], &[])]);
    let read = parse_pnml("", write_pnml(&net).as_bytes()).unwrap();
    assert_eq!((read.places(), read.transitions()), (net.places(), net.transitions()));
}
