//! Whatever is asked for by a name that nothing has: the answer says what may have been meant.

use super::*;

#[test]
fn what_is_unknown_is_refused_with_the_nearest_names() {
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

    // What has no match behind a star is no mistake.
    assert!(client.properties(Some("/teller/*/nothing")).unwrap().is_empty());
    assert!(client.revert("modules.teller").unwrap().is_empty());
}
