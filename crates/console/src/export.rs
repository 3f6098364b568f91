//! Page that plays a recorded run without an agent, in one file.
//! It is the console's page with another client: `web/recorded` answers in place of an agent.

use std::fmt::Write as _;
use std::io::{self, Write as _};

use data_encoding::BASE64;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;
use serde_json::{Value as Json, json};
use slate_sorted::SortedMap;

use crate::pages::BUILT_IN;

/// Scheme of the page's modules, which lie in the page itself.
/// A page opened from a disk imports nothing by a path.
const SCHEME: &str = "slate:";

/// Modules of the panels.
const PANELS: &str = "slate:/panels/";

/// Client of an agent, and the client of a recorded run that takes its place.
const CLIENT: &str = "/api.js";
const RECORDED_CLIENT: &str = "/recorded/api.js";

/// Value of a property in a run: time in ns, sequence number, and the value.
pub type RecordedSample = (u64, u64, Json);

/// Part of a run that an exported page contains.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RecordedRun {
    /// Name of the agent.
    pub agent: String,
    /// Name of the recording; empty for the last seconds of an agent.
    pub file: String,
    /// Time of the first value, ns.
    pub from: u64,
    /// Time of the last value, ns.
    pub to: u64,
    /// Answers of the agent, by the path after `/api/v1`.
    pub resources: SortedMap<String, Json>,
    /// Values of properties in the order of time, by the path of the property.
    pub histories: SortedMap<String, Vec<RecordedSample>>,
}

/// Returns an HTML page that plays a run.
/// It needs neither an agent nor a web server.
///
/// # Errors
/// When the run can't be compressed.
pub fn exported_page(run: &RecordedRun) -> io::Result<Vec<u8>> {
    let mut modules = SortedMap::new();
    let mut styles = String::new();
    let mut icon = String::new();
    for (path, content) in BUILT_IN {
        let text = String::from_utf8_lossy(content);
        match path.rsplit_once('.').map(|(_, kind)| kind) {
            Some("js") if *path != CLIENT => {
                let path = if *path == RECORDED_CLIENT { CLIENT } else { path };
                modules.insert(specifier(path), data("text/javascript", in_page(&text).as_bytes()));
            }
            Some("css") => writeln!(styles, "{text}").map_err(io::Error::other)?,
            Some("svg") => icon = data("image/svg+xml", content),
            _ => {}
        }
    }
    let panels: Vec<_> = modules.keys().filter(|name| name.starts_with(PANELS)).cloned().collect();
    let mut content = serde_json::to_value(run)?;
    content["panels"] = json!(panels);
    let imports = json!({ "imports": modules });
    let title = escaped(&run.agent);
    let (stop, app) = (specifier("/stop.js"), specifier("/app.js"));
    let recording = BASE64.encode(&compressed(&serde_json::to_vec(&content)?)?);
    let page = format!(
        r#"<!doctype html>
<html lang="en" data-recorded>
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="dark light">
<title>{title}</title>
<link rel="icon" id="icon" href="{icon}">
<style>
{styles}</style>
<script type="importmap">{imports}</script>
<script type="application/octet-stream" id="recording">{recording}</script>
</head>
<body>
<button id="stop" class="stop" type="button" hidden><span id="stop-answer"></span></button>
<div id="app"><p class="splash">Slate</p></div>
<script type="module">import "{stop}"; import "{app}";</script>
</body>
</html>
"#
    );
    Ok(page.into_bytes())
}

/// Returns the name of a module in the page.
fn specifier(path: &str) -> String {
    format!("{SCHEME}{path}")
}

/// Returns the text of a module whose imports lie in the page.
fn in_page(text: &str) -> String {
    text.replace(r#"from "/"#, &format!(r#"from "{SCHEME}/"#))
}

fn data(kind: &str, content: &[u8]) -> String {
    format!("data:{kind};base64,{}", BASE64.encode(content))
}

fn compressed(content: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(content)?;
    encoder.finish()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}
