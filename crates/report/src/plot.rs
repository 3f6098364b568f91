//! The plots of a report.

mod animation;
mod canvas;
mod curves;
mod map;
mod scene;
mod timeline;
mod view;
mod visibility;

pub(crate) use animation::animation;
pub(crate) use curves::{Curve, curves};
pub(crate) use map::{beside, map};
pub(crate) use scene::scene;
pub(crate) use timeline::timeline;

use crate::{Route, Sample, Scene, Trajectory};
use plotters::style::RGBColor;
use slate_sorted::{SortedMap, SortedSet};

/// A drawing and its headings.
pub(crate) struct Drawing<'a> {
    pub title: String,
    pub caption: String,
    pub scene: &'a Scene,
    pub trajectory: &'a Trajectory,
}

/// Returns the color of a route: red or blue, as in the paper.
/// The tones are distinct for people with any common color blindness.
fn color(route: Option<Route>) -> RGBColor {
    match route {
        Some(Route::Deliberative) => RGBColor(204, 51, 17),
        Some(Route::Reactive) => RGBColor(0, 119, 187),
        None => RGBColor(153, 153, 153),
    }
}

/// Assigns a color to each robot, the same in all plots.
/// Scripted robots are black and grey.
fn palette<'a>(report: &Drawing<'a>) -> SortedMap<&'a str, RGBColor> {
    const CONTROLLED: [RGBColor; 5] = [
        RGBColor(136, 34, 136),
        RGBColor(0, 136, 136),
        RGBColor(119, 85, 34),
        RGBColor(119, 119, 17),
        RGBColor(204, 102, 153),
    ];
    const SCRIPTED: [RGBColor; 2] = [RGBColor(0, 0, 0), RGBColor(119, 119, 119)];
    let placed = report.scene.robots.iter().map(|robot| robot.name.as_str());
    let names: SortedSet<&str> = report.trajectory.robots().into_iter().chain(placed).collect();
    let is_scripted = |name: &&str| report.scene.scripted.iter().any(|scripted| scripted == name);
    let (scripted, controlled): (Vec<&str>, Vec<&str>) = names.into_iter().partition(is_scripted);
    let scripted = scripted.into_iter().zip(SCRIPTED.into_iter().cycle());
    scripted.chain(controlled.into_iter().zip(CONTROLLED.into_iter().cycle())).collect()
}

fn has_route(samples: &[&Sample], route: Option<Route>) -> bool {
    samples.iter().any(|sample| sample.route == route)
}

/// Returns true if a coordinate can be drawn.
/// It must be finite, and not so far out that nothing else remains visible.
fn drawable(meters: f64) -> bool {
    meters.abs() <= 1e6
}

/// The smallest interval that contains all included numbers.
#[derive(Clone, Copy, Default)]
struct Extent(Option<(f64, f64)>);

impl Extent {
    fn include(&mut self, value: f64) {
        if drawable(value) {
            let (low, high) = self.0.unwrap_or((value, value));
            self.0 = Some((if value < low { value } else { low }, if value > high { value } else { high }));
        }
    }

    /// Pads the interval by a share of its size at both ends; at least `least` wide.
    fn padded(self, share: f64, least: f64) -> (f64, f64) {
        let (low, high) = self.0.unwrap_or((0.0, 0.0));
        let padding = (high - low) * share;
        widened((low - padding, high + padding), least)
    }
}

/// Returns the interval made at least `least` wide around its middle.
fn widened((low, high): (f64, f64), least: f64) -> (f64, f64) {
    let lack = least - (high - low);
    if lack > 0.0 { (low - lack / 2.0, high + lack / 2.0) } else { (low, high) }
}

/// Returns the number at a tick of an axis that shows `span` in all.
fn axis_label(value: f64, span: f64) -> String {
    let decimals = match span {
        span if span > 20.0 => 0,
        span if span > 2.0 => 1,
        span if span > 0.2 => 2,
        _ => 3,
    };
    let text = format!("{value:.decimals$}");
    let is_zero = text.chars().all(|character| matches!(character, '-' | '0' | '.'));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}
