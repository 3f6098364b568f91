//! The page: files for browsers, of the program, of a folder, and of a project.

use std::io::Read;
use std::path::Path;

use serde_json::{Value as Json, json};

use crate::agent::Running;
use crate::client::{Client, Reply};
use crate::modules::CONFIGURATION;

/// A browser asks so.
fn browse(run: &Running, path: &str, more: &str) -> Reply {
    let client = Client::new(run.address(), "");
    let head = format!("{}{more}", client.head("GET", path));
    client.raw(format!("{head}Connection: close\r\n\r\n").as_bytes())
}

#[test]
fn a_browser_gets_the_page_without_a_token_and_caches_it() {
    let run = Running::start("pages");
    let page = browse(&run, "/", "Accept: text/html\r\n");
    assert_eq!((page.status, page.header("content-type")), (200, "text/html; charset=utf-8"));
    assert!(page.text().contains("id=\"stop\""), "the stop is there before anything else is");
    assert!(!page.text().contains("<script>"), "what stands in the page itself is not let run");
    assert!(page.header("content-security-policy").starts_with("default-src 'self'"));
    let script = browse(&run, "/app.js", "");
    assert_eq!((script.status, script.header("content-type")), (200, "text/javascript; charset=utf-8"));
    let known = format!("If-None-Match: {}\r\n", script.header("etag"));
    let again = browse(&run, "/app.js", &known);
    assert_eq!((again.status, again.body.len()), (304, 0));
    let panels: Vec<String> = serde_json::from_slice(&browse(&run, "/panels.json", "").body).unwrap();
    assert!(panels.len() >= 10);
    for panel in panels {
        assert!(browse(&run, &panel, "").text().contains("export default { id: "), "{panel}");
    }
    // Licences stay in the repository, and what is no page needs a token as ever.
    for path in ["/lib/VENDOR.md", "/lib/LICENSE-htm", "/nothing.js", "/app.js/", "//app.js", "/web/app.js"] {
        assert_eq!(browse(&run, path, "").status, 401, "{path}");
    }
}

#[test]
fn gzip_gives_same_files_in_fewer_bytes() {
    let run = Running::start("gzip");
    let plain = browse(&run, "/theme.css", "");
    assert_eq!((plain.header("content-encoding"), plain.header("vary")), ("", "accept-encoding"));
    let small = browse(&run, "/theme.css", "Accept-Encoding: deflate, gzip;q=0.8, br\r\n");
    assert_eq!((small.status, small.header("content-encoding")), (200, "gzip"));
    assert!(small.body.len() * 3 < plain.body.len(), "{} of {}", small.body.len(), plain.body.len());
    let mut unpacked = Vec::new();
    flate2::read::GzDecoder::new(&small.body[..]).read_to_end(&mut unpacked).unwrap();
    assert_eq!(unpacked, plain.body);
    // What is kept of one form is not taken for the other.
    assert_ne!(small.header("etag"), plain.header("etag"));
    let known = format!("If-None-Match: {}\r\nAccept-Encoding: gzip\r\n", small.header("etag"));
    assert_eq!(browse(&run, "/theme.css", &known).status, 304);
    for refused in ["identity", "gzip;q=0", "gzip; q=0.0", "xgzip"] {
        let reply = browse(&run, "/theme.css", &format!("Accept-Encoding: {refused}\r\n"));
        assert_eq!((reply.header("content-encoding"), &reply.body), ("", &plain.body), "{refused}");
    }
}

#[test]
fn the_first_page_names_all_files_that_it_takes_to_show_it() {
    let run = Running::start("announced");
    let page = browse(&run, "/", "Accept: text/html\r\n").text();
    let panels: Vec<String> = serde_json::from_slice(&browse(&run, "/panels.json", "").body).unwrap();
    for path in panels.iter().map(String::as_str).chain(["/slate.js", "/map/draw.js", "/lib/uplot.js"]) {
        assert!(page.contains(&format!("href=\"{path}\"")), "{path} is asked for late");
    }
}

#[test]
fn pages_of_a_folder_replace_the_built_in_ones_and_nothing_else() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("assets");
    std::fs::create_dir_all(folder.join("panels")).unwrap();
    std::fs::write(folder.join("index.html"), "<p>mine</p>").unwrap();
    std::fs::write(folder.join("panels/mine.js"), "export default { id: 1 };").unwrap();
    std::fs::write(folder.join("panels/.hidden.js"), "").unwrap();
    std::fs::write(folder.join("secret.txt"), "").unwrap();
    let settings = format!("[console]\nport = 0\nassets = {folder:?}");
    let run = Running::start_with("assets", &format!("{CONFIGURATION}\n{settings}"));
    assert_eq!(browse(&run, "/", "Accept: text/html\r\n").text(), "<p>mine</p>");
    let panels: Json = serde_json::from_slice(&browse(&run, "/panels.json", "").body).unwrap();
    assert_eq!(panels, json!(["/panels/mine.js"]));
    // It is read each time.
    std::fs::write(folder.join("index.html"), "<p>changed</p>").unwrap();
    assert_eq!(browse(&run, "/", "Accept: text/html\r\n").text(), "<p>changed</p>");
    let elsewhere = [
        "/app.js",
        "/secret.txt",
        "/panels/.hidden.js",
        "/../assets/index.html",
        "/panels/../index.html",
        "/%2e%2e/assets/index.html",
        "/project/../Cargo.html",
        "/project/panels/../../src/lib.js",
    ];
    for path in elsewhere {
        assert_eq!(browse(&run, path, "").status, 401, "{path}");
    }
}

#[test]
fn layouts_have_plain_names_and_say_which_panels_stand_where() {
    let run = Running::start("layouts");
    let fit =
        json!({ "title": "Mine", "columns": [{ "share": 1, "tiles": [{ "panel": "map", "share": 1 }] }] });
    let developer = run.client("developer");
    let save = |name: &str, layout: &Json| developer.send("PUT", &format!("/layouts/{name}"), Some(layout));
    for name in ["a.b", "%2e%2e", "..%2fmine", "a%20b", &"a".repeat(65)] {
        assert!(save(name, &fit).problem(400).contains("64 letters"), "{name}");
    }
    for layout in [
        json!({}),
        json!({ "title": "Mine" }),
        json!({ "title": 1, "columns": [1] }),
        json!({ "title": "", "columns": [] }),
    ] {
        assert!(save("mine", &layout).problem(422).contains("columns"), "{layout}");
    }
    let endless = json!({ "title": "x".repeat(100_000), "columns": [1] });
    assert!(save("mine", &endless).problem(422).contains("longer"));
    assert!(
        run.client("operator").send("PUT", "/layouts/mine", Some(&fit)).problem(403).contains("operator")
    );
    assert!(developer.send("DELETE", "/layouts/mine", None).problem(404).contains("layouts"));
    assert_eq!(run.get("/layouts").json(), json!({}));
}
