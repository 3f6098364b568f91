//! Self-contained page.

use std::fmt::Write;

use super::table::{Column, Table};

/// Style sheet: light or dark as the reader prefers, and dark on white on paper.
/// Pictures are dark on white; in dark mode their brightness is inverted, which keeps their colors.
const STYLE: &str = "\
:root { color-scheme: light dark; --ground: #fff; --ink: #222; --faint: #5f5f5f; --line: #d5d5d5; --band: #f4f4f4; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #141414; --ink: #e4e4e4; --faint: #a5a5a5; --line: #3d3d3d; --band: #1f1f1f; }
  figure svg, figure img { filter: invert(0.92) hue-rotate(180deg); }
}
body { margin: 0 auto; padding: 1rem 1.5rem 3rem; max-width: 76rem; background: var(--ground); color: var(--ink);
  font: 1rem/1.45 system-ui, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.7rem; margin: 0.6rem 0 0.2rem; }
h2 { font-size: 1.25rem; margin: 2.2rem 0 0.6rem; padding-bottom: 0.2rem; border-bottom: 1px solid var(--line); }
p { margin: 0.4rem 0; max-width: 60rem; }
p.faint, figcaption, caption { color: var(--faint); }
nav ul { list-style: none; display: flex; flex-wrap: wrap; gap: 0.3rem 1.2rem; margin: 0.8rem 0; padding: 0; }
a { color: inherit; }
figure { margin: 1rem 0 1.6rem; }
figure svg, figure img { max-width: 100%; height: auto; display: block; }
figcaption { font-size: 0.9rem; margin-top: 0.3rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.9rem; font-variant-numeric: tabular-nums; margin: 0.6rem 0; }
caption { text-align: left; padding-bottom: 0.3rem; }
th, td { padding: 0.2rem 0.8rem 0.2rem 0; text-align: left; vertical-align: top; }
thead th { border-bottom: 1px solid var(--ink); white-space: nowrap; }
tbody tr:nth-child(even) { background: var(--band); }
tbody th { font-weight: normal; }
.number { text-align: right; white-space: nowrap; overflow-wrap: normal; }
.unit { color: var(--faint); font-weight: normal; }
summary { cursor: pointer; white-space: nowrap; }
@media print {
  :root { --ground: #fff; --ink: #000; --faint: #444; --line: #999; --band: #fff; }
  figure svg, figure img { filter: none; }
  body { max-width: none; padding: 0; font-size: 10pt; }
  h2 { break-after: avoid; }
  figure, tr { break-inside: avoid; }
  .wide { overflow: visible; }
  nav { display: none; }
}
";

/// The text of a page as it grows.
pub(super) struct Html(String);

/// Escapes text, so that it contains no markup.
/// A character that no document may hold becomes a replacement character.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(' '),
            // Text that runs the other way could make what stands beside it look like something else.
            '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{fffe}' | '\u{ffff}' => {
                out.push('\u{fffd}')
            }
            character if character.is_control() => out.push('\u{fffd}'),
            character => out.push(character),
        }
    }
    out
}

/// Returns the anchor of a heading.
fn anchor(heading: &str) -> String {
    heading.to_lowercase().split_whitespace().collect::<Vec<_>>().join("-")
}

impl Html {
    pub fn new(title: &str) -> Self {
        let title = escaped(title);
        Self(format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        ))
    }

    fn push(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.0.write_fmt(text);
    }

    pub fn contents<'a>(&mut self, headings: impl Iterator<Item = &'a str>) {
        self.push(format_args!("<nav aria-label=\"Contents\"><ul>\n"));
        for heading in headings {
            self.push(format_args!("<li><a href=\"#{}\">{}</a></li>\n", anchor(heading), escaped(heading)));
        }
        self.push(format_args!("</ul></nav>\n"));
    }

    pub fn heading(&mut self, heading: &str) {
        self.push(format_args!("<h2 id=\"{}\">{}</h2>\n", anchor(heading), escaped(heading)));
    }

    pub fn paragraph(&mut self, text: &str, is_faint: bool) {
        let class = if is_faint { " class=\"faint\"" } else { "" };
        self.push(format_args!("<p{class}>{}</p>\n", escaped(text)));
    }

    /// Adds a picture that this program has drawn.
    pub fn drawn(&mut self, svg: &str, caption: &str) {
        let caption = escaped(caption);
        self.push(format_args!(
            "<figure role=\"img\" aria-label=\"{caption}\">\n{}\n<figcaption>{caption}</figcaption>\n</figure>\n",
            svg.trim()
        ));
    }

    /// Adds a picture from elsewhere.
    /// It is an image, so that its content has no effect.
    pub fn found(&mut self, svg: &[u8], caption: &str) {
        let caption = escaped(caption);
        self.push(format_args!(
            "<figure>\n<img alt=\"{caption}\" src=\"data:image/svg+xml;base64,{}\"/>\n<figcaption>{caption}</figcaption>\n</figure>\n",
            base64(svg)
        ));
    }

    /// Adds a table, or its first `most` rows.
    pub fn table(&mut self, table: &Table, most: usize) {
        self.push(format_args!("<div class=\"wide\"><table>\n"));
        let shown = table.rows.len().min(most);
        if shown < table.rows.len() {
            let (all, name) = (table.rows.len(), escaped(&table.name));
            self.push(format_args!(
                "<caption>The first {shown} of {all}; {name}.csv has them all.</caption>\n"
            ));
        }
        self.push(format_args!("<thead><tr>"));
        for Column { name, unit, is_number, .. } in &table.columns {
            let unit = match unit.is_empty() {
                true => String::new(),
                false => format!(" <span class=\"unit\">[{}]</span>", escaped(unit)),
            };
            self.push(format_args!("<th scope=\"col\"{}>{}{unit}</th>", class(*is_number), escaped(name)));
        }
        self.push(format_args!("</tr></thead>\n<tbody>\n"));
        for row in &table.rows[..shown] {
            self.push(format_args!("<tr>"));
            for (cell, column) in row.iter().zip(&table.columns) {
                let text = escaped(cell);
                let text = match column.collapsed_count(cell) {
                    Some(count) => format!("<details><summary>{count} modules</summary>{text}</details>"),
                    None => text,
                };
                self.push(format_args!("<td{}>{text}</td>", class(column.is_number)));
            }
            self.push(format_args!("</tr>\n"));
        }
        self.push(format_args!("</tbody></table></div>\n"));
    }

    pub fn finish(mut self) -> String {
        self.0.push_str("</body>\n</html>\n");
        self.0
    }
}

fn class(is_number: bool) -> &'static str {
    if is_number { " class=\"number\"" } else { "" }
}

/// Encodes bytes as base64 (RFC 4648).
/// Own, as the embedded picture is its only use: to encode takes ten lines, and the crate `base64` would be a further
/// dependency of each program that writes reports.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let at = |i: usize| u32::from(three.get(i).copied().unwrap_or_default());
        let bits = at(0) << 16 | at(1) << 8 | at(2);
        for index in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * index) & 63) as usize];
            text.push(if index > three.len() { '=' } else { char::from(letter) });
        }
    }
    text
}
