//! The table `[dds]`.

use slate_dds::{DdsSettings, Representation, TABLE};
use slate_runtime::configuration::{Configuration, Options, Report};

const TARGET: &str = "type = \"demo::Target\", idl = \"tests/dds/target.idl\"";

fn read(text: &str) -> Result<Option<DdsSettings>, Report> {
    let options = Options { extra_tables: vec![TABLE.into()], ..Options::default() };
    DdsSettings::of(&Configuration::from_text("r2.toml", text, &options).unwrap())
}

#[test]
fn topics_are_named_by_entries_and_links() {
    let text = format!(
        "agent.name = \"r2\"\n[dds]\ndomain = 7\nread.\"planner/target\" = {{ topic = \"Target\", {TARGET}, depth = 1 }}\n\
         write.\"rt/scan\" = \"laser/scan\"\n[links]\n\"planner/goal\" = \"dds:Goal\"\n\
         \"dds:Seen\" = {{ from = \"/planner/seen\", {TARGET}, representation = \"xcdr2\", transient_local = true }}\n"
    );
    let settings = read(&text).unwrap().unwrap();
    assert_eq!((settings.domain, settings.trusted), (7, false));
    let read: Vec<_> = settings
        .topics
        .read
        .iter()
        .map(|own| (own.input.as_str(), own.topic.as_str(), own.quality.quality.depth))
        .collect();
    assert_eq!(read, [("planner/target", "Target", 1), ("planner/goal", "Goal", 10)]);
    let of = settings.topics.read[0].quality.of.as_ref().unwrap();
    assert!(of.structure.as_ref().is_some_and(|own| own.has_key()) && of.name == "demo::Target");
    assert!(settings.topics.read[1].quality.of.is_none());
    let written: Vec<_> =
        settings.topics.write.iter().map(|own| (own.topic.as_str(), own.property.as_str())).collect();
    assert_eq!(written, [("rt/scan", "laser/scan"), ("Seen", "planner/seen")]);
    let seen = &settings.topics.write[1].quality;
    assert!(
        seen.quality.transient_local && seen.of.as_ref().unwrap().representation == Representation::Xcdr2
    );
    assert!(self::read("agent.name = \"r2\"").unwrap().is_none());
}

#[test]
fn errors_have_line_and_help() {
    let entry = |entry: &str| format!("agent.name = \"r2\"\n[dds]\nread.\"planner/target\" = {entry}\n");
    let cases = [
        (
            entry("{ topic = \"Target\", idl = \"tests/dds/target.idl\" }"),
            "needs a `type` that names one of its structs",
        ),
        (
            entry("{ topic = \"Target\", type = \"demo::Goal\", idl = \"tests/dds/target.idl\" }"),
            "has no struct demo::Goal",
        ),
        (
            entry("{ topic = \"Target\", type = \"demo::Goal\", idl = \"none.idl\" }"),
            "none.idl:1: No such file",
        ),
        (
            entry("{ topic = \"Target\", type = \"demo Target\" }"),
            "`demo Target` can't be the name of a type",
        ),
        (entry("\"a topic\""), "`a topic` can't be the name of a topic: it has ' '"),
        (entry("{ topic = \"Target\", representation = \"xcdr2\" }"), "representation"),
        (entry("{ topic = \"Target\", depth = 0 }"), "`depth` is a number from 1"),
        (entry("\"T\"\nwrite.\"T\" = \"planner/seen\""), "T is read by /planner/target and written by"),
        (entry("\"T\"\ndomain = 233"), "a domain is a number from 0 to 232, found 233"),
        (entry("\"T\"\nqos = 1"), "qos"),
        ("agent.name = \"r2\"\n[dds]\ndomain = 7\n".to_owned(), "[dds] names no topic"),
        (
            "agent.name = \"r2\"\n[dds]\nwrite.\"T\" = { from = \"a/b\", representation = \"xcdr2\" }\n"
                .to_owned(),
            "messages of ROS are xcdr1",
        ),
        (
            "agent.name = \"r2\"\n[dds]\nwrite.\"T\" = { from = \"a/b\", representation = \"xml\" }\n"
                .to_owned(),
            "expected `representation` to be xcdr1 or xcdr2, found \"xml\"",
        ),
    ];
    for (text, words) in cases {
        let report = read(&text).unwrap_err().to_string();
        assert!(report.contains(words) && report.contains("r2.toml:"), "{text}\n{report}");
    }
    let report =
        read(&entry(&format!("{{ topic = \"T\", {} }}", TARGET.replace("Target", "Goal")))).unwrap_err();
    assert!(report.to_string().contains("demo::GrowingTarget"), "{report}");
}
