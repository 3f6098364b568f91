//! Files that are edited and saved while the agent runs.

use super::*;

/// A configuration file in a folder of its own.
fn file(of: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(name(of));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("robot.toml");
    std::fs::write(&path, TEXT).unwrap();
    path
}

#[test]
fn an_edited_file_is_taken_over_or_refused_whole() {
    let path = file("edited");
    let log = MemoryTarget::default();
    let database = Database::open(&path, configuration::Options::default()).unwrap();
    let agent = load(&database, log.clone());
    let edit = |text: &str| {
        assert_ne!(text, TEXT);
        std::fs::write(&path, text).unwrap();
    };
    edit(&TEXT.replace("first = 2.0", "first = 8.0, second = 5.0"));
    eventually(|| number(&agent, "teller/params/first") == 8.0);
    assert_eq!(number(&agent, "teller/params/second"), 5.0);
    let said = |word: &str| log.lines().iter().any(|line| line.to_string().contains(word));
    edit(&TEXT.replace("first = 2.0", "first = -3.0, second = 6.0"));
    eventually(|| said("outside 0 to 1000000") && said("robot.toml:5") && said("help"));
    assert_eq!(number(&agent, "teller/params/first"), 8.0);
    assert_eq!(number(&agent, "teller/params/second"), 5.0);
    // What is left out has its default again.
    edit(&TEXT.replace("first = 2.0", "first = 4.0"));
    eventually(|| number(&agent, "teller/params/first") == 4.0);
    assert_eq!(number(&agent, "teller/params/second"), 1.0);
    drop(agent);
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn a_setting_for_the_next_start_waits_and_blocks_nothing_else() {
    let path = file("waiting");
    let log = MemoryTarget::default();
    let database = Database::open(&path, configuration::Options::default()).unwrap();
    let agent = load(&database, log.clone());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    let said = |word: &str| log.lines().iter().any(|line| line.to_string().contains(word));
    let with = |text: &str| TEXT.replace("[modules.relay]", &format!("[modules.relay]\n{text}"));
    std::fs::write(&path, with("every = '50ms'").replace("first = 2.0", "first = 8.0")).unwrap();
    eventually(|| said("take effect at the next start: modules.relay.every"));
    assert_eq!(number(&agent, "teller/params/first"), 8.0);
    let waiting = |client: &mut Client| -> Vec<_> {
        let different = client.differences().unwrap();
        different.into_iter().map(|one| (one.path, one.file, one.present)).collect()
    };
    let every = ("modules.relay.every".to_owned(), Some("\"50ms\"".to_owned()), None);
    assert_eq!(waiting(&mut client), std::slice::from_ref(&every));
    // Later edits and saves continue, and save nothing of what waits.
    std::fs::write(&path, with("every = '50ms'").replace("first = 2.0", "first = 9.0")).unwrap();
    eventually(|| number(&agent, "teller/params/first") == 9.0);
    client.set(&[change("modules.teller.params.second", "3.5")]).unwrap();
    client.save(SaveTo::Origin).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("every = '50ms'") && text.contains("3.5"), "{text}");
    assert_eq!(waiting(&mut client), [every]);
    let agent_only = configuration::Options::default();
    assert_eq!(Database::open(&path, agent_only).unwrap().get("modules.relay.every").unwrap().len(), 1);
    // A module that came or went waits with all that belongs to it.
    let another = "[modules.another]\nkind = 'relay'\n[links]\n\"another/input\" = \"counter/number\"";
    let more = text.replace("every = '50ms'\n", "").replace("[links]", another);
    std::fs::write(&path, more).unwrap();
    eventually(|| said("take effect at the next start: ") && said("modules.another.kind"));
    assert!(!agent.modules().contains(&"another".into()));
    // What is taken out again waits no more.
    std::fs::write(&path, text.replace("every = '50ms'\n", "")).unwrap();
    eventually(|| database.waiting().is_empty());
    assert!(client.differences().unwrap().is_empty());
    drop((server, agent));
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn another_variant_is_applied_whole_at_once_or_waits_whole() {
    let path = file("variants");
    let with = |pace: &str| {
        format!(
            "pace = '{pace}'\n{TEXT}\n[choices.pace]\nslow = {{}}\nfast.modules.teller.params.first = 8.0\n\
             rare.modules.teller.params.first = 9.0\nrare.modules.relay.every = '50ms'\n"
        )
    };
    std::fs::write(&path, with("slow")).unwrap();
    let log = MemoryTarget::default();
    let database = Database::open(&path, configuration::Options::default()).unwrap();
    let agent = load(&database, log.clone());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    let first = || number(&agent, "teller/params/first");
    assert_eq!(first(), 2.0);
    // Half of it would be no variant.
    std::fs::write(&path, with("rare")).unwrap();
    let said = |word: &str| log.lines().iter().any(|line| line.to_string().contains(word));
    eventually(|| said("take effect at the next start: ") && said("modules.relay.every"));
    assert_eq!(first(), 2.0);
    std::fs::write(&path, with("fast")).unwrap();
    eventually(|| first() == 8.0);
    client.set(&[change("pace", "slow")]).unwrap();
    assert_eq!(first(), 2.0);
    let refusal = client.set(&[change("pace", "rare")]).unwrap_err().to_string();
    assert!(refusal.contains("modules.relay.every"), "{refusal}");
    assert_eq!(first(), 2.0);
    drop((server, agent));
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn changes_are_saved_with_the_comments_of_the_file() {
    let path = file("saved");
    std::fs::write(&path, TEXT.replace("[modules.teller]", "[modules.teller] # it tells")).unwrap();
    let agent =
        load(&Database::open(&path, configuration::Options::default()).unwrap(), MemoryTarget::default());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    client.set(&[change("modules.teller.params.first", "3.5")]).unwrap();
    assert_eq!(client.save(SaveTo::Origin).unwrap().files, std::slice::from_ref(&path));
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("[modules.teller] # it tells\nparams = { first = 3.5 }"), "{text}");
    assert!(client.differences().unwrap().is_empty());
    client.set(&[change("modules.teller.params.first", "4.5")]).unwrap();
    assert!(refused(client.save(SaveTo::Host)).message.contains("no file of this machine"));
    drop((server, agent));
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}

#[test]
fn refused_edit_is_reported_and_not_overwritten() {
    let path = file("refused");
    let agent =
        load(&Database::open(&path, configuration::Options::default()).unwrap(), MemoryTarget::default());
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    client.set(&[change("modules.teller.params.second", "3.5")]).unwrap();
    assert_eq!(client.refused_edit().unwrap(), None);
    let edited = TEXT.replace("first = 2.0", "first = -3.0");
    std::fs::write(&path, &edited).unwrap();
    // At once, whether or not the agent has looked at the file by now.
    for refusal in [client.refused_edit().unwrap().unwrap(), refused(client.save(SaveTo::Origin))] {
        assert!(refusal.message.contains("robot.toml:5:"), "{refusal:?}");
        assert!(refusal.message.contains("outside 0 to 1000000"), "{refusal:?}");
        assert!(refusal.report.unwrap().contains("params = { first = -3.0"));
    }
    assert!(refused(client.save(SaveTo::Origin)).message.starts_with("nothing is saved: a file was edited"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), edited);
    assert_eq!(number(&agent, "teller/params/second"), 3.5);
    std::fs::write(&path, TEXT.replace("[modules.relay]", "[modules.relay] # mended")).unwrap();
    eventually(|| client.save(SaveTo::Origin).is_ok());
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("{ first = 2.0, second = 3.5 }\n[modules.relay] # mended"), "{text}");
    drop((server, agent));
    std::fs::remove_dir_all(path.parent().unwrap()).unwrap();
}
