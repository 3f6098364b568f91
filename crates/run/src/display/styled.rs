//! Lines of colored text.

use std::fmt::Write;

use crossterm::style::{Color, Stylize};
use slate_report::Route;

/// Line that consists of spans of one color each.
#[derive(Clone, Debug, Default)]
pub struct StyledLine {
    spans: Vec<(String, Option<Color>)>,
    width: usize,
}

impl StyledLine {
    /// Appends text.
    pub fn push(&mut self, text: impl Into<String>, color: Option<Color>) {
        let text = text.into();
        self.width += text.chars().count();
        self.spans.push((text, color));
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

    /// Returns the first `columns` columns, with colors if wanted.
    pub fn render(&self, columns: usize, has_color: bool) -> String {
        let (mut text, mut left) = (String::new(), columns);
        for (span, color) in &self.spans {
            let cut: String = span.chars().take(left).collect();
            left -= cut.chars().count();
            let _ = match color.filter(|_| has_color && !cut.trim().is_empty()) {
                Some(color) => write!(text, "{}", cut.with(color)),
                None => write!(text, "{cut}"),
            };
        }
        text
    }
}

/// Returns the color of a route, as in reports and the web console.
pub fn route_color(route: Option<Route>) -> Option<Color> {
    match route? {
        Route::Deliberative => Some(Color::Red),
        Route::Reactive => Some(Color::Blue),
    }
}
