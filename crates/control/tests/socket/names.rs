//! Requests with unknown names: the answer suggests similar names.

use super::*;

#[test]
fn unknown_name_is_refused_with_nearest_names() {
    let (_agent, _server, mut client) = open("nearest");
    let mut nearest = |says: &str, call: &mut dyn FnMut(&mut Client) -> Option<Refusal>| {
        let Some(Refusal { message, help, .. }) = call(&mut client) else {
            panic!("{says}: it was not refused")
        };
        assert!(format!("{message}\n{help}").contains(says), "{says}: {message}\n{help}");
    };
    fn why<T: std::fmt::Debug>(result: Result<T, ClientError>) -> Option<Refusal> {
        result.is_err().then(|| refused(result))
    }
    // A module, a property, a field; in front of what is right, too.
    nearest("nearest: teller/told", &mut |client| why(client.read("/teller/tod")));
    nearest("nearest: teller/told", &mut |client| why(client.read("/tellr/told/first")));
    nearest("nearest: teller/apart, teller/enabled", &mut |client| why(client.read("/tellr")));
    nearest("it has first, second", &mut |client| why(client.read("/teller/told/frist")));
    nearest("nearest: teller/told", &mut |client| why(client.history("/teller/tod")));
    nearest("nearest: teller/apart", &mut |client| why(client.properties(Some("/tellr/**"))));
    nearest("nearest: teller/told", &mut |client| why(client.properties(Some("/teller/tld"))));

    let link = |to: &'static str, from: &'static str| {
        move |client: &mut Client| why(client.link(to, from, &[], true))
    };
    nearest("did you mean teller?", &mut link("tellr/input", "counter/number"));
    nearest("did you mean input?", &mut link("teller/inptu", "counter/number"));
    nearest("did you mean counter?", &mut link("teller/input", "contr/number"));
    nearest("did you mean number?", &mut link("teller/input", "counter/numbr"));
    nearest("did you mean value?", &mut link("teller/input/value", "counter/number/valeu"));
    nearest("did you mean relay/input?", &mut |client| why(client.unlink("relay/inpt", true)));

    nearest("did you mean teller?", &mut |client| why(client.enable("tellr", false)));
    nearest("did you mean teller?", &mut |client| why(client.describe("tellr")));
    nearest("did you mean wheel?", &mut |client| why(client.arm(Some("whel"))));
    nearest("modules.teller.params.first", &mut |client| why(client.settings("modules.tellr")));
    nearest("modules.teller.params.first", &mut |client| why(client.settings("modules.teller.params.frist")));
    nearest("modules.teller.params.first", &mut |client| why(client.revert("modules.tellr")));
    nearest("did you mean `modules`?", &mut |client| {
        why(client.set(&[change("modles.teller.params.first", "1")]))
    });
    nearest("did you mean `teller`?", &mut |client| {
        why(client.set(&[change("modules.tellr.params.first", "1")]))
    });

    // What has no match behind a star is not an error.
    assert!(client.properties(Some("/teller/*/nothing")).unwrap().is_empty());
    assert!(client.revert("modules.teller").unwrap().is_empty());
}

/// What takes a URL of this agent: an operation, what a request has before the URL and after it, and its body.
const WITH_URL: &[(&str, &str, &str, &str)] = &[
    ("properties", "/properties?pattern=", "", ""),
    ("read", "/slate/AGENT/", "?bare", ""),
    ("write", "/slate/AGENT/", "/first?dry_run", "3.0"),
    ("patch", "/slate/AGENT/", "?dry_run", r#"{"first":3.0}"#),
    ("send", "/slate/AGENT/", "", "{}"),
    ("queue", "/queues/AGENT/", "", ""),
    ("history", "/history/AGENT/", "", ""),
    ("watch", "/watch", "", r#"{"of":[{"url":"URL"}],"within":0}"#),
    ("measure", "/measure", "", r#"{"urls":["URL"],"time":0}"#),
    ("describe", "/modules/", "", ""),
    ("switch", "/modules/", "", r#"{"enabled":true}"#),
    ("link", "/links/", "?dry_run", r#"{"from":"counter/number"}"#),
    ("unlink", "/links/", "?dry_run", ""),
    ("log", "/log?module=", "", ""),
    ("arm", "/arm", "", r#"{"actuator":"URL"}"#),
    ("take", "/leases", "", r#"{"actuator":"URL"}"#),
];

/// Operations with such arguments that mean something else: patterns of recordings are those of `properties`, values are saved
/// of another agent by a whole URL, and paths of settings have dots.
const OTHERS: &[&str] = &["start_recording", "save_values", "settings", "revert"];

/// The arguments of an operation: parts of its path, parameters and fields of its body.
fn arguments(operation: &slate_control::Operation) -> Vec<String> {
    let mut found: Vec<String> = operation.path.split(['/', '{', '}']).map(str::to_owned).collect();
    found.retain(|part| operation.path.contains(&format!("{{{part}}}")));
    found.extend(operation.parameters().map(|parameter| parameter.name.to_owned()));
    let body = operation.body.map_or(Value::Null, |body| body());
    found.extend(body["properties"].as_object().into_iter().flat_map(|fields| fields.keys().cloned()));
    found
}

#[test]
fn a_url_means_the_same_with_and_without_a_slash() {
    let (_agent, server, _client) = open("slash");
    let takes_url = |operation: &slate_control::Operation| {
        let urls = ["path", "module", "input", "url", "urls", "of", "pattern", "actuator", "exclude"];
        arguments(operation).iter().any(|argument| urls.contains(&argument.as_str()))
    };
    let all = slate_control::operations::OPERATIONS;
    let mut named: Vec<_> = WITH_URL.iter().map(|(name, ..)| name).chain(OTHERS).copied().collect();
    let mut taking: Vec<_> = all.iter().filter(|one| takes_url(one)).map(|one| one.name).collect();
    named.sort_unstable();
    taking.sort_unstable();
    assert_eq!(named, taking, "each operation that takes a URL is tried here");

    for &(name, before, after, body) in WITH_URL {
        let operation = slate_control::operations::by_name(name).unwrap();
        let url = match name {
            "describe" | "switch" | "log" => "teller",
            "link" => "teller/input",
            "unlink" => "relay/input",
            "arm" | "take" => "wheel",
            "write" | "patch" => "teller/params",
            _ => "teller/told",
        };
        let before = before.replace("AGENT", server.name());
        let mut asked = Vec::new();
        for slash in ["", "/", "%2F"] {
            let in_body = body.contains("URL");
            let path = if in_body { before.clone() } else { format!("{before}{slash}{url}{after}") };
            // A slash in JSON is one as it is.
            let body = body.replace("URL", &format!("{}{url}", if slash.is_empty() { "" } else { "/" }));
            let (status, mut answer) = Raw::connect(&server).ask(operation.method, &path, &body);
            if let Some(lease) = answer["lease"].as_str() {
                let given_back = format!("/leases/{lease}");
                assert_eq!(Raw::connect(&server).ask("DELETE", &given_back, "").0, 200);
            }
            answer.as_object_mut().and_then(|fields| fields.remove("lease"));
            // The measurement is reported under the requested name.
            answer.get_mut(0).and_then(|one| one.get_mut("url")).map(Value::take);
            asked.push((status, answer));
        }
        assert_eq!(asked[0], asked[1], "{name}");
        assert_eq!(asked[0], asked[2], "{name}");
        // It has no mailbox, and nothing that records.
        let status = match name {
            "send" => 405,
            "history" => 409,
            _ => 200,
        };
        assert_eq!(asked[0].0, status, "{name}: {:?}", asked[0]);
    }
}

#[test]
fn one_sender_of_an_inbox_is_unlinked_by_its_name() {
    let text = "[modules.a]\nkind = \"sender\"\n[modules.b]\nkind = \"sender\"\n[modules.receiver]\n[links]\n\
                \"receiver/notes\" = [\"a/note\", \"b/note\"]\n";
    let file = format!("{}.toml", name("senders"));
    let database = Database::from_text(&file, text, configuration::Options::default()).unwrap();
    let agent = Agent::load_with(&database, &plugins(), Options::default()).unwrap();
    let server = Server::open(&agent).unwrap();
    let mut client = Client::connect(server.name()).unwrap();
    let senders = |client: &mut Client| -> Vec<String> {
        client.links().unwrap().into_iter().map(|link| link.from).collect()
    };
    assert_eq!(senders(&mut client), ["/a/note", "/b/note"]);
    let unknown = refused(client.unlink_from("receiver/notes", Some("c/note"), false));
    assert!(unknown.message.contains("has no link from `c/note`"), "{unknown:?}");
    client.unlink_from("receiver/notes", Some("/a/note"), true).unwrap();
    assert_eq!(senders(&mut client), ["/a/note", "/b/note"], "a dry run");
    client.unlink_from("/receiver/notes", Some("a/note"), false).unwrap();
    assert_eq!(senders(&mut client), ["/b/note"]);
}
