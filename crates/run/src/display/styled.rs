//! Lines of coloured text.

use std::fmt::Write;

use crossterm::style::{Color, Stylize};
use slate_record::Route;

/// Line that consists of spans of one colour each.
#[derive(Clone, Debug, Default)]
pub struct StyledLine {
    spans: Vec<(String, Option<Color>)>,
    width: usize,
}

impl StyledLine {
    /// Appends text.
    pub fn push(&mut self, text: impl Into<String>, colour: Option<Color>) {
        let text = text.into();
        self.width += text.chars().count();
        self.spans.push((text, colour));
    }

    /// Appends another line.
    pub fn append(&mut self, other: Self) {
        self.width += other.width;
        self.spans.extend(other.spans);
    }

    /// Returns the number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Appends blanks up to a column.
    pub fn pad(&mut self, column: usize) {
        if self.width < column {
            self.push(" ".repeat(column - self.width), None);
        }
    }

    /// Returns the first `columns` columns, with colours if wanted.
    pub fn render(&self, columns: usize, has_colour: bool) -> String {
        let (mut text, mut left) = (String::new(), columns);
        for (span, colour) in &self.spans {
            let cut: String = span.chars().take(left).collect();
            left -= cut.chars().count();
            let _ = match colour.filter(|_| has_colour && !cut.trim().is_empty()) {
                Some(colour) => write!(text, "{}", cut.with(colour)),
                None => write!(text, "{cut}"),
            };
        }
        text
    }
}

/// Returns the colour of a route, as in reports and the web console.
pub fn route_colour(route: Option<Route>) -> Option<Color> {
    match route? {
        Route::Deliberative => Some(Color::Red),
        Route::Reactive => Some(Color::Blue),
    }
}
