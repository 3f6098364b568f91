//! Files, their places and their texts.

use super::*;

#[test]
fn files_that_cannot_be_read_are_named_where_they_are_included() {
    let folder = Folder::new(
        "files",
        &[
            ("missing.toml", "include = [\n  \"none.toml\",\n]\n"),
            ("circle.toml", "include = [\"sub/back.toml\"]\n"),
            ("sub/back.toml", "include = \"../circle.toml\"\n"),
            ("broken.toml", "include = [\"sub/typo.toml\", \"sub/worse.toml\"]\n[loop]\nperiod = 5\n"),
            ("sub/typo.toml", "[loop\n"),
            ("sub/worse.toml", "a = = 1\n"),
            ("folder.toml", "include = [\"sub\"]\n"),
        ],
    );
    fs::write(folder.path("latin.toml"), b"# first\nname = \"\xe9\"\n").unwrap();
    let message =
        |name: &str| folder.plain(Configuration::load(folder.path(name), &Options::default()).unwrap_err());
    assert_eq!(
        message("none.toml"),
        "can't read the configuration none.toml: No such file or directory (os error 2) (give the path of a TOML file)"
    );
    assert_eq!(
        message("missing.toml"),
        "missing.toml:2:3: can't read the configuration none.toml: No such file or directory (os error 2) (an included \
         file is found relative to the one that includes it)"
    );
    assert_eq!(
        message("circle.toml"),
        "sub/back.toml:1:11: can't read the configuration sub/../circle.toml: it includes itself (remove one `include` \
         of the circle)"
    );
    assert!(message("folder.toml").contains("it is not a file"));
    assert!(message("latin.toml").contains("line 2 is not UTF-8"));
    let both = message("broken.toml");
    assert!(both.contains("sub/typo.toml:1:6: ") && both.contains("sub/worse.toml:1:"), "{both}");
    assert!(!both.contains("period"), "what follows from a broken file is not reported: {both}");
}

#[test]
fn a_file_that_two_others_include_counts_once() {
    let folder = Folder::new(
        "diamond",
        &[
            ("exp1.toml", "include = [\"a.toml\", \"b.toml\"]\n"),
            ("a.toml", "include = [\"base.toml\"]\n[agent]\nseed = 2\n"),
            ("b.toml", "include = [\"base.toml\"]\n"),
            ("base.toml", "[agent]\nseed = 1\n"),
        ],
    );
    let configuration = Configuration::load(folder.path("exp1.toml"), &Options::default()).unwrap();
    assert_eq!(configuration.seed().value, 2);
}

#[test]
fn embedded_files_are_included_in_place_of_those_on_the_disk() {
    let options = Options {
        embedded: &[
            (
                "../robots/body.toml",
                "include = \"wheels.toml\"\n[agent]\nseed = 2\n[loop]\nperiod = \"30ms\"\n",
            ),
            ("../robots/wheels.toml", "[loop]\nhang = \"2s\"\n"),
        ],
        ..Options::default()
    };
    let read = |include: &str| {
        let text = format!("include = [{include}]\n[agent]\nseed = 3\n");
        Configuration::from_text("exp1.toml", &text, &options)
    };
    let configuration = read("\"../robots/body.toml\", \"../robots/wheels.toml\"").unwrap();
    let (period, hang) = (configuration.period().value, configuration.hang().value);
    assert_eq!((configuration.seed().value, period, hang), (3, 30_000_000, 2_000_000_000));
    let refusal = read("\"../robots/other.toml\"").unwrap_err().to_string();
    assert!(refusal.contains("can't read the configuration ../robots/other.toml"), "{refusal}");
    let wrong = Options { embedded: &[("body.toml", "[loop]\nperiod = 5\n")], ..Options::default() };
    let refusal = Configuration::from_text("exp1.toml", "include = \"body.toml\"\n", &wrong).unwrap_err();
    assert!(refusal.to_string().contains("body.toml:2:"), "{refusal}");
}

#[test]
fn errors_found_later_point_into_the_right_file() {
    let folder = Folder::new(
        "later",
        &[
            ("exp1.toml", "include = [\"links.toml\"]\n"),
            ("links.toml", "[links]\n\"a/pose\" = \"lokalizer/pose\"\n"),
        ],
    );
    let configuration = Configuration::load(folder.path("exp1.toml"), &Options::default()).unwrap();
    let link = &configuration.links()[0];
    let source =
        configuration.diagnostic(link.from.span, "no module `lokalizer`", Some("did you mean?".into()));
    let to = configuration.diagnostic(link.to.span, "no module `a`", None);
    let report = Report::from(vec![source, to]);
    assert_eq!(
        folder.plain(&report),
        "links.toml:2:12: no module `lokalizer` (did you mean?)\nlinks.toml:2:1: no module `a`"
    );
    assert!(report.render(false).contains("  ────────┬───────\n"), "{report:?}");
}

#[test]
fn applications_check_their_own_tables() {
    let configuration = with_sets("[world]\nlayout = \"paper\"\n", &["world.layuot=authors"]).unwrap();
    let world = configuration.table("world").unwrap();
    let unknown = configuration.unknown_keys(world, "in [world]", &["layout", "size"]);
    assert_eq!(
        Report::from(unknown).to_string(),
        "--set:1:7: unknown key `layuot` in [world] (did you mean `layout`?)"
    );
    let configuration = read("controller = \"rocs\"\n").unwrap();
    assert_eq!(configuration.value("controller").unwrap().value, Value::Text("rocs".into()));
    assert!(configuration.table("world").is_none());
}

#[test]
fn documents_are_kept_with_their_comments() {
    let text = "# about the agent\n[agent]\nseed = 3 # lucky\n";
    let configuration = read(text).unwrap();
    let main = configuration.sources().iter().find(|source| source.name() == "exp1.toml").unwrap();
    let mut document = main.document().unwrap().clone().into_mut();
    assert_eq!(document.to_string(), text);
    document["agent"]["name"] = toml_edit::value("scout");
    assert_eq!(document.to_string(), format!("{text}name = \"scout\"\n"));
}

#[test]
fn a_deep_or_long_text_is_refused_and_not_a_crash() {
    let deep = format!("{}a = 1", "a.".repeat(100_000));
    let nested = format!("world = {}", "[".repeat(100_000));
    for text in [deep, nested] {
        assert!(read(&text).is_err());
        assert!(with_sets("", &[&text]).is_err());
    }
}

#[test]
fn a_byte_order_mark_and_windows_line_ends_are_fine() {
    let configuration = read("\u{feff}[agent]\r\nseed = 3\r\n").unwrap();
    assert_eq!(configuration.origin("agent.seed").unwrap().to_string(), "exp1.toml:2");
}

/// Checks that what a report shows can be shown, whatever was read.
fn never_panics(text: &str, sets: &[&str]) {
    // A random text may not read files of this machine.
    if text.contains("include") {
        return;
    }
    match with_sets(text, sets) {
        Ok(configuration) => drop(configuration.clone()),
        Err(report) => assert!(!report.diagnostics().is_empty() && !report.render(false).is_empty()),
    }
}

proptest! {
    #[test]
    fn arbitrary_text_never_panics(text in any::<String>(), set in any::<String>()) {
        never_panics(&text, &[&set]);
    }

    #[test]
    fn text_of_toml_tokens_never_panics(
        tokens in prop::collection::vec(
            prop::sample::select(&[
                "[", "]", "{", "}", "=", ".", ",", "\"", "'", "#", "\n", "\r\n", " ", "\\", "/", "é", "\u{feff}", "1", "-",
                "1e9", "inf", "true", "\"20ms\"", "\"a/b\"", "\"slate://x/y/z\"", "\"\"\"", "agent", "name", "seed", "loop",
                "period", "modules", "r2", "links", "from", "previous", "stale", "actuators", "command", "limits", "safe",
                "robots", "world", "log", "levels", "level", "mission", "outcome", "every", "on", "params", "inputs",
            ][..]),
            0..40,
        ),
        equals in any::<bool>(),
    ) {
        let text = tokens.concat();
        never_panics(&text, &[]);
        let joined = tokens.join(if equals { "=" } else { "." });
        never_panics("", &[&joined, &text]);
    }

    #[test]
    fn a_changed_character_never_panics(at in 0..WHOLE.len(), with in "[\\[\\]{}=.\"'#\n a-z0-9é-]{0,3}", cut in 0..4usize) {
        let end = (at + cut).min(WHOLE.len());
        never_panics(&format!("{}{with}{}", &WHOLE[..at], &WHOLE[end..]), &[]);
    }

    #[test]
    fn any_text_given_as_a_quoted_setting_arrives_whole(text in "[ -~é\n]{0,40}") {
        let quoted = toml_edit::Value::from(text.as_str()).to_string();
        let configuration = with_sets("", &[&format!("world.text={quoted}")]).unwrap();
        prop_assert_eq!(configuration.value("world.text").unwrap().as_str(), Some(text.as_str()));
    }

    // Without words that may be true, false, inf or nan.
    #[test]
    fn any_word_given_as_a_bare_setting_arrives_whole(word in "[a-eg-hj-mo-su-z][a-z#=.:/ -]{0,20}[a-z#=]") {
        let configuration = with_sets("", &[&format!("world.text={word}")]).unwrap();
        prop_assert_eq!(configuration.value("world.text").unwrap().as_str(), Some(word.as_str()));
    }
}
