//! Tree as an SVG drawing: one row for each node, below its parent.

use std::fmt::Write;

use slate_behavior_tree::BehaviorTree;

use super::paper::document;
use crate::graph::svg::escaped;

/// Approximate width of a letter, pixels.
const LETTER_WIDTH: f64 = 6.7;
/// Height of a row.
const ROW_HEIGHT: f64 = 26.0;
/// Height of a node.
const NODE_HEIGHT: f64 = 20.0;
/// Width of a level.
const LEVEL_WIDTH: f64 = 28.0;
const HEADER_HEIGHT: f64 = 36.0;
const MARGIN: f64 = 24.0;

/// Row of a drawing.
pub struct DrawnRow {
    /// Row above it in the tree.
    pub parent: Option<usize>,
    pub level: usize,
    pub title: String,
    /// Class `control`, `leaf` or none.
    pub class: &'static str,
}

impl DrawnRow {
    fn width(&self) -> f64 {
        self.title.chars().count() as f64 * LETTER_WIDTH + 12.0
    }

    fn left(&self) -> f64 {
        MARGIN + self.level as f64 * LEVEL_WIDTH
    }
}

/// Returns the rows of a behavior tree.
pub fn rows(tree: &BehaviorTree) -> Vec<DrawnRow> {
    let nodes = tree.nodes();
    let mut rows: Vec<DrawnRow> = nodes
        .iter()
        .map(|node| DrawnRow {
            parent: None,
            level: node.depth(),
            title: if node.name() == node.tag() {
                node.tag().into()
            } else {
                format!("{}: {}", node.tag(), node.name())
            },
            class: match node.children().len() {
                0 => "leaf",
                1 => "",
                _ => "control",
            },
        })
        .collect();
    for (number, node) in nodes.iter().enumerate() {
        node.children().iter().for_each(|child| rows[*child].parent = Some(number));
    }
    rows
}

/// Returns a tree as an SVG document; a row is below its parent.
pub fn draw(name: &str, rows: &[DrawnRow]) -> String {
    let right = rows.iter().map(|row| row.left() + row.width()).max_by(f64::total_cmp).unwrap_or(0.0);
    let (width_of_all, height) = (right + MARGIN, rows.len() as f64 * ROW_HEIGHT + HEADER_HEIGHT + MARGIN);
    let title = escaped(name);
    let mut text = format!("<text class=\"title\" x=\"{MARGIN}\" y=\"24\">{title}</text>\n");
    // Writing into a string can't fail.
    for (number, row) in rows.iter().enumerate() {
        if let Some(parent) = row.parent {
            let x = rows[parent].left() + LEVEL_WIDTH / 2.0;
            let (from, to) = (top(parent) + NODE_HEIGHT, top(number) + NODE_HEIGHT / 2.0);
            let _ =
                writeln!(text, "<path class=\"edge\" d=\"M{x:.1} {from:.1}V{to:.1}H{:.1}\"/>", row.left());
        }
    }
    for (number, row) in rows.iter().enumerate() {
        let _ = writeln!(
            text,
            "<rect class=\"node {class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{NODE_HEIGHT}\" \
             rx=\"4\"/><text x=\"{label:.1}\" y=\"{base:.1}\">{title}</text>",
            class = row.class,
            x = row.left(),
            y = top(number),
            width = row.width(),
            label = row.left() + 6.0,
            base = top(number) + 14.0,
            title = escaped(&row.title)
        );
    }
    document((width_of_all, height), &format!("the tree {name}"), &text)
}

fn top(row: usize) -> f64 {
    HEADER_HEIGHT + row as f64 * ROW_HEIGHT
}
