//! Demands of links on other agents.

use std::sync::{Arc, Mutex};

use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::sharing::{Compression, Pace, RemoteDemand, RemotePath, Sharing, SharingError, Site};
use slate_runtime::{Agent, NewLink, Options, Rate};
use slate_sorted::{SortedMap, SortedSet};

use crate::links::support::all;

/// Keeps what is wanted.
#[derive(Clone, Default)]
struct Kept(Arc<Mutex<SortedMap<RemotePath, RemoteDemand>>>);

impl Sharing for Kept {
    fn start(&mut self, _: Site) -> Result<(), SharingError> {
        Ok(())
    }

    fn set_demands(&mut self, demands: SortedMap<RemotePath, RemoteDemand>) {
        *self.0.lock().unwrap() = demands;
    }

    fn carriers(&self) -> SortedSet<String> {
        ["local".into()].into()
    }
}

fn agent(links: &str) -> (Agent, Kept) {
    let text = format!(
        "time.source = \"a\"\n[modules.a]\nkind = \"counter\"\n[modules.judge]\n[modules.relay]\n[modules.sum]\n\
         kind = \"collector\"\n[links]\n{links}"
    );
    let database = Database::from_text("test.toml", &text, Reading::default()).unwrap();
    let kept = Kept::default();
    let options = Options { rate: Rate::Max, sharing: Some(Box::new(kept.clone())), ..Options::default() };
    (Agent::load_with(&database, &all(), options).unwrap(), kept)
}

/// The pace and the compression that are wanted of a path of the other agent.
fn wanted(kept: &Kept, path: &str) -> (Pace, Compression) {
    let path = RemotePath { agent: "o".into(), path: format!("m/{path}") };
    match kept.0.lock().unwrap().get(&path) {
        Some(&RemoteDemand::Values { pace, compression, .. }) => (pace, compression),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_link_shows_its_rate_and_thinning() {
    let (_agent, kept) = agent(
        r#"
"relay/input" = { from = "slate://o/m/a", interval = "50ms", compression = "jpeg:80" }
"judge/left" = { from = "slate://o/m/b", rate = "20Hz", compression = "none" }
"judge/right" = "slate://o/m/c"
"#,
    );
    assert_eq!(wanted(&kept, "a"), (Pace::OnChange(50_000_000), Compression::Jpeg(80)));
    assert_eq!(wanted(&kept, "b"), (Pace::Every(50_000_000), Compression::None));
    assert_eq!(wanted(&kept, "c"), (Pace::OnChange(0), Compression::Lossless));
}

#[test]
fn of_links_to_one_property_the_one_that_wants_the_most_decides() {
    let both = |one: &str, other: &str| {
        let link = |to: &str, path: &str, says: &str| {
            format!("\"{to}\" = {{ from = \"slate://o/m/{path}\", {says} }}\n")
        };
        let mut seen = Vec::new();
        for (paths, says) in [(("p", "p/first"), (one, other)), (("p/first", "p"), (other, one))] {
            let links =
                link("relay/input/value", paths.0, says.0) + &link("judge/left/first", paths.1, says.1);
            let (_agent, kept) = agent(&links);
            assert_eq!(wanted(&kept, "p"), wanted(&kept, "p/first"));
            seen.push(wanted(&kept, "p"));
        }
        assert_eq!(seen[0], seen[1], "whichever comes first");
        seen[0]
    };
    let pace = |one: &str, other: &str| both(one, other).0;
    assert_eq!(pace("interval = \"1s\"", "interval = \"50ms\""), Pace::OnChange(50_000_000));
    assert_eq!(pace("interval = \"1s\"", "mode = \"reliable\""), Pace::OnChange(0));
    assert_eq!(pace("interval = \"1s\"", "rate = \"10Hz\""), Pace::Every(100_000_000));
    assert_eq!(pace("interval = \"100ms\"", "rate = \"10Hz\""), Pace::OnChange(100_000_000));
    assert_eq!(pace("rate = \"1Hz\"", "rate = \"10Hz\""), Pace::Every(100_000_000));
    let compression = |one: &str, other: &str| {
        both(&format!("compression = \"{one}\""), &format!("compression = \"{other}\"")).1
    };
    assert_eq!(compression("jpeg:50", "jpeg:90"), Compression::Jpeg(90));
    assert_eq!(compression("jpeg:100", "lossless"), Compression::Lossless);
    assert_eq!(compression("lossless", "none"), Compression::None);
    assert_eq!(both("compression = \"jpeg:50\"", "mode = \"reliable\"").1, Compression::Lossless);
}

#[test]
fn a_link_that_is_made_later_says_it_too() {
    let (agent, kept) = agent("\"relay/input\" = { from = \"slate://o/m/a\", rate = \"1s\" }\n");
    let link = NewLink::new("relay/input", "slate://o/m/a")
        .with("interval", "\"5ms\"")
        .with("compression", "\"jpeg:1\"");
    agent.composer().link(&link).unwrap();
    assert_eq!(wanted(&kept, "a"), (Pace::OnChange(5_000_000), Compression::Jpeg(1)));
    let refused = |link: NewLink, says: &str| {
        let report = agent.composer().link(&link).unwrap_err().to_string();
        assert!(report.contains(says), "{report}");
    };
    let new = || NewLink::new("relay/input", "slate://o/m/a");
    refused(new().with("compression", "\"jpeg:0\""), "unknown compression `jpeg:0`");
    refused(new().with("compression", "\"jpeg\""), "unknown compression `jpeg`");
    refused(new().with("interval", "\"soon\""), "soon");
    refused(new().with("rate", "\"1s\"").with("interval", "\"5ms\""), "`rate` gives a period");
    refused(new().with("carrier", "\"udp\""), "no carrier `udp`");
    let inside = NewLink::new("relay/input", "a/number").with("interval", "\"5ms\"");
    refused(inside, "`interval` has no meaning here");
    let inside = NewLink::new("relay/input", "a/number").with("compression", "\"none\"");
    refused(inside, "`compression` has no meaning here");
}
