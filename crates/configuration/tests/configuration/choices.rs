//! Variants: a setting that chooses what else holds.

use slate_configuration::Variant;

use super::*;

/// The configuration of a text with those settings, of an application with a table `world`.
fn with_sets(text: &str, sets: &[&str]) -> Result<Configuration, Report> {
    let options = Options { extra_tables: vec!["world".into()], ..options(sets) };
    Configuration::from_text("exp1.toml", text, &options)
}

fn read(text: &str) -> Result<Configuration, Report> {
    with_sets(text, &[])
}

/// The only error of a text with a setting.
#[track_caller]
fn refusal(text: &str, sets: &[&str]) -> String {
    let report = with_sets(text, sets).unwrap_err();
    assert_eq!(report.diagnostics().len(), 1, "{report:?}");
    report.to_string()
}

const FILE: &str = "controller = \"own\"\n[modules.turn]\n[modules.drive]\nparams = { speed = 0.5 }\n\
                    [choices.controller.own]\n[choices.controller.wall]\nmodules.turn.enabled = false\n\
                    modules.drive.params.speed = 0.1\n";

fn number(configuration: &Configuration, path: &str) -> Option<f64> {
    configuration.value(path)?.value.as_f64()
}

fn is_enabled(configuration: &Configuration, module: &str) -> bool {
    configuration.modules().iter().find(|known| known.name.value == module).unwrap().enabled.value
}

#[test]
fn a_variant_goes_over_the_file_and_a_setting_over_the_variant() {
    let usual = read(FILE).unwrap();
    assert!(is_enabled(&usual, "turn"));
    assert_eq!(number(&usual, "modules.drive.params.speed"), Some(0.5));
    assert!(
        Variant::chosen(&usual)
            .all(|variant| (variant.choice, variant.name, variant.has_settings)
                == ("controller", "own", false))
    );

    let wall = with_sets(FILE, &["controller=wall"]).unwrap();
    assert!(!is_enabled(&wall, "turn"));
    assert_eq!(number(&wall, "modules.drive.params.speed"), Some(0.1));
    let origin = &wall.settings("modules.drive.params.speed").unwrap()[0].origin;
    assert_eq!(origin.to_string(), "exp1.toml:8");
    assert!(Variant::chosen(&wall).all(|variant| variant.has_settings));

    let faster = with_sets(FILE, &["modules.drive.params.speed=0.3", "controller=wall"]).unwrap();
    assert_eq!(number(&faster, "modules.drive.params.speed"), Some(0.3));
}

#[test]
fn variants_that_are_not_chosen_are_listed_with_their_setting() {
    let listed = |sets: &[&str]| {
        let configuration = with_sets(FILE, sets).unwrap();
        Variant::all(&configuration)
            .filter(|variant| !variant.is_chosen)
            .map(|variant| variant.setting())
            .collect::<Vec<_>>()
    };
    assert_eq!(listed(&[]), ["controller = \"wall\""]);
    assert_eq!(listed(&["controller=wall"]), ["controller = \"own\""]);
    // Any name can be set as it is listed.
    let text =
        "\"my way\" = \"a b\"\n[modules.a]\n[choices.\"my way\".\"a b\"]\n[choices.\"my way\".\"c \\\"d\"]\n";
    let configuration = read(text).unwrap();
    let listed: Vec<_> = Variant::all(&configuration)
        .filter(|variant| !variant.is_chosen)
        .map(|variant| variant.setting())
        .collect();
    assert_eq!(listed, ["\"my way\" = \"c \\\"d\""]);
    let chosen = with_sets(text, &[&listed[0]]).unwrap();
    assert_eq!(Variant::chosen(&chosen).next().unwrap().name, "c \"d");
}

#[test]
fn an_including_file_drops_a_choice() {
    let own = "include = [\"base.toml\"]\n[choices]\ncontroller = false\n";
    let folder = Folder::new("choices-dropped", &[("base.toml", FILE), ("own.toml", own)]);
    let read = |sets: &[&str]| {
        let options = Options { extra_tables: Vec::new(), ..options(sets) };
        Database::open(folder.path("own.toml"), options)
    };
    let configuration = read(&[]).unwrap().current();
    assert_eq!(Variant::all(&configuration).count(), 0);
    assert!(is_enabled(&configuration, "turn"));
    assert!(read(&["controller=wall"]).unwrap_err().to_string().contains("unknown key `controller`"));
}

#[test]
fn a_variant_may_give_an_input_a_value_in_the_place_of_its_link() {
    let text = "planner = \"linked\"\n[modules.a]\n[links]\n\"a/goal\" = \"b/goal\"\n\
                [choices.planner]\nlinked = {}\nfixed.modules.a.inputs.goal = { x = 1.0 }\n";
    assert_eq!(read(text).unwrap().links().len(), 1);
    let fixed = with_sets(text, &["planner=fixed"]).unwrap();
    assert!(fixed.links().is_empty());
    assert_eq!(number(&fixed, "modules.a.inputs.goal.x"), Some(1.0));
}

#[test]
fn a_file_that_includes_another_adds_a_variant_and_chooses_it() {
    let more = "include = [\"exp1.toml\"]\ncontroller = \"slow\"\n[choices.controller.slow.modules.drive]\n\
                params.speed = 0.05\n";
    let folder = Folder::new("choices", &[("exp1.toml", FILE), ("slow.toml", more)]);
    let slow = Database::open(folder.path("slow.toml"), Options::default()).unwrap().current();
    assert_eq!(number(&slow, "modules.drive.params.speed"), Some(0.05));
    assert!(is_enabled(&slow, "turn"));
}

#[test]
fn an_agent_of_several_has_its_own_variant() {
    let text = format!("{FILE}[agents.first]\n[agents.second]\n");
    let read = |agent: &str| {
        let options = Options {
            agent: Some(agent.into()),
            extra_tables: Vec::new(),
            ..options(&["agents.second.controller=wall"])
        };
        Configuration::from_text("team.toml", &text, &options).unwrap()
    };
    assert_eq!(number(&read("first"), "modules.drive.params.speed"), Some(0.5));
    assert_eq!(number(&read("second"), "modules.drive.params.speed"), Some(0.1));
}

#[test]
fn invalid_choice_is_reported_with_place() {
    assert_eq!(
        refusal(FILE, &["controller=best"]),
        "--set:1:12: `controller` chooses `best`, which is not a variant (expected one of own, wall)"
    );
    assert_eq!(
        refusal("pace = 3\n[choices.pace]\nslow = {}\n", &[]),
        "exp1.toml:1:8: `pace` chooses a whole number, which is not a variant (expected one of slow)"
    );
    assert_eq!(
        refusal("[choices.pace]\nslow = {}\n", &[]),
        "exp1.toml:1:10: no variant of `pace` is chosen (write pace = \"...\" at the top; expected one of slow)"
    );
    assert_eq!(
        refusal("[choices.modules]\nslow = {}\n", &[]),
        "exp1.toml:1:10: `modules` is a section and chooses no variant (give the choice another name)"
    );
    assert_eq!(
        refusal("pace = \"slow\"\n[choices.pace.slow]\ninclude = [\"slow.toml\"]\n", &[]),
        "exp1.toml:3:1: a variant can't set `include` (write it at the top of the file)"
    );
    assert_eq!(
        refusal("[choices.world]\nslow = {}\n", &[]),
        "exp1.toml:1:10: `world` is a section and chooses no variant (give the choice another name)"
    );
    assert_eq!(
        refusal("pace = \"slow\"\nkind = \"a\"\n[choices.kind.a]\n[choices.pace.slow]\nkind = \"b\"\n", &[]),
        "exp1.toml:5:1: a variant can't set `kind` (write it at the top of the file)"
    );
    assert!(refusal("pace = \"slow\"\n[choices]\npace = {}\n", &[]).contains("[choices.pace.usual]"));
    // Also in a variant that is not chosen.
    let other = |settings: &str| refusal(&format!("{FILE}[choices.controller.other]\n{settings}\n"), &[]);
    assert!(other("bad = 3").contains("unknown key `bad` in [choices.controller.other]"));
    // A file that includes this one may have removed a module, so that only the chosen variant has to fit.
    let ghost = format!("{FILE}[choices.controller.other]\nmodules.ghost.params.gain = 1.0\n");
    assert!(read(&ghost).is_ok());
    assert!(refusal(&ghost, &["controller=other"]).contains("no module is called `ghost`"));
    // Files have the variants; settings choose.
    let set = "choices.controller.wall.modules.drive.params.speed=0.2";
    assert!(refusal(FILE, &[set]).contains("a setting chooses a variant, and can't change one"));
    // Without variants it is not a setting at all.
    assert!(refusal("pace = \"slow\"\n", &[]).contains("unknown key `pace`"));
}

#[test]
fn another_variant_is_chosen_at_run_time_and_saved() {
    let folder = Folder::new("chosen", &[("exp1.toml", FILE)]);
    let database = Database::open(folder.path("exp1.toml"), Options::default()).unwrap();
    let changes = database.set(&[("controller", "wall")]).unwrap();
    let paths: Vec<_> = changes.iter().map(|change| &*change.path).collect();
    assert_eq!(paths, ["controller", "modules.drive.params.speed", "modules.turn.enabled"]);
    // What is changed above the variant is saved into it.
    database.set(&[("modules.drive.params.speed", "0.2")]).unwrap();
    database.save(SaveTo::Origin).unwrap();
    let text = fs::read_to_string(folder.path("exp1.toml")).unwrap();
    let expected = FILE.replace("\"own\"", "\"wall\"").replace("speed = 0.1", "speed = 0.2");
    assert_eq!(text, expected);
}

#[test]
fn recording_keeps_settings_above_its_variant() {
    let recorded = "controller = \"wall\"\n[modules.turn]\nenabled = false\n[modules.drive]\nparams = { speed = 0.3 }\n\
                    [choices.controller.wall]\nmodules.turn.enabled = false\nmodules.drive.params.speed = 0.1\n\
                    modules.ghost.params.gain = 1.0\n";
    let read = |sets: &[&str]| {
        let sets = sets.iter().map(|&set| set.to_owned()).collect();
        slate_configuration::recorded_configuration("run", recorded, sets)
    };
    let again = read(&[]).unwrap().current();
    assert_eq!(number(&again, "modules.drive.params.speed"), Some(0.3));
    assert!(
        read(&["controller=wall"]).unwrap_err().to_string().contains("`ghost`"),
        "a setting chooses anew"
    );
}
