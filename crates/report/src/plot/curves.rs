//! Numbers over time.

use super::{
    canvas::{Canvas, FAINT, GRID, LEGEND_LINE, Mark, PIXEL, TITLE_HEIGHT, failed, font, image, stroke},
    widened,
};
use crate::Error;
use plotters::prelude::*;

const WIDTH: i32 = 1200 * PIXEL;
const HEIGHT: i32 = 520 * PIXEL;
const LEFT: i32 = 150 * PIXEL;
const LEGEND: i32 = 420 * PIXEL;
const AXIS: i32 = 58 * PIXEL;
const EDGE: i32 = 16 * PIXEL;

/// Tones that are distinct for people with any common color blindness.
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 119, 187),
    RGBColor(204, 51, 17),
    RGBColor(0, 136, 136),
    RGBColor(136, 34, 136),
    RGBColor(119, 119, 17),
    RGBColor(204, 102, 153),
    RGBColor(34, 34, 34),
];

/// A number over time.
pub(crate) struct Curve {
    pub name: String,
    /// Time in seconds, and the number; one that is not finite interrupts the line.
    pub points: Vec<(f64, f64)>,
}

pub(crate) fn curves(title: &str, curves: &[Curve]) -> Result<String, Error> {
    let lines = i32::try_from(curves.len()).unwrap_or(0).saturating_mul(LEGEND_LINE);
    let height = TITLE_HEIGHT + HEIGHT.max(lines) + AXIS + EDGE;
    image((LEFT + WIDTH + LEGEND, height), |canvas| draw(canvas, title, curves))
}

fn draw(canvas: &Canvas, title: &str, curves: &[Curve]) -> Result<(), Error> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let time = extent(points().map(|(time, _)| *time), 0.0);
    let value = extent(points().map(|(_, value)| *value), 0.05);
    let caption: usize = curves.iter().map(|curve| curve.points.len()).sum();
    canvas.title(title, &format!("{caption} values"))?;
    let area = canvas.area.clone().shrink((EDGE, TITLE_HEIGHT), (LEFT - EDGE + WIDTH, HEIGHT + AXIS));
    let mut chart = ChartBuilder::on(&area)
        .y_label_area_size(LEFT - EDGE)
        .x_label_area_size(AXIS)
        .build_cartesian_2d(time.0..time.1, value.0..value.1)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .x_labels(12)
        .y_labels(8)
        .x_label_formatter(&|at| label(*at, time.1 - time.0))
        .y_label_formatter(&|at| label(*at, value.1 - value.0))
        .label_style(font(20))
        .axis_desc_style(font(22))
        .axis_style(stroke(FAINT, 1))
        .set_all_tick_mark_size(5 * PIXEL)
        .bold_line_style(stroke(GRID, 1))
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(failed)?;
    let mut legend = Vec::new();
    for (curve, color) in curves.iter().zip(COLORS.into_iter().cycle()) {
        let share = |at: f64, (low, high): (f64, f64)| (at - low) / (high - low);
        let pixel = |(at, number): &(f64, f64)| {
            let right = share(*at, time) * f64::from(WIDTH);
            let up = share(*number, value) * f64::from(HEIGHT);
            number
                .is_finite()
                .then(|| (LEFT + right.round() as i32, TITLE_HEIGHT + HEIGHT - up.round() as i32))
        };
        let pixels: Vec<_> = curve.points.iter().map(pixel).collect();
        canvas.trace(&pixels, color, 2)?;
        legend.push((Mark::Line(color, 4), curve.name.clone()));
    }
    canvas.legend((LEFT + WIDTH + 16 * PIXEL, TITLE_HEIGHT + 20 * PIXEL), &legend)
}

/// Returns the interval of the finite numbers, padded by a share at both ends.
/// It is never empty.
fn extent(numbers: impl Iterator<Item = f64>, share: f64) -> (f64, f64) {
    // Beyond, a difference of two of them is infinite.
    let drawable = numbers.filter(|number| number.abs() < 1e300);
    let ends = drawable.fold(None, |ends: Option<(f64, f64)>, number| {
        let (low, high) = ends.unwrap_or((number, number));
        Some((if number < low { number } else { low }, if number > high { number } else { high }))
    });
    let (low, high) = ends.unwrap_or((0.0, 0.0));
    let padding = (high - low) * share;
    let size = if low.abs() > high.abs() { low.abs() } else { high.abs() };
    // A constant gets an axis that shows it, and floats can tell its ends apart.
    let least = if high > low {
        0.0
    } else if size > 1.0 {
        size * 0.01
    } else {
        0.01
    };
    widened((low - padding, high + padding), least)
}

/// Returns the number at a tick of an axis that shows `span` in all.
fn label(number: f64, span: f64) -> String {
    match span {
        span if !(1e-3..1e7).contains(&span) => format!("{number:.3e}"),
        _ => super::axis_label(number, span),
    }
}
