//! Position and route of each robot over time.

use super::{
    Extent, axis_label,
    canvas::{
        Canvas, FAINT, GRID, INK, LEGEND_LINE, Mark, PIXEL, Pixel, TITLE_HEIGHT, failed, font, image, stroke,
    },
    color, drawable, has_route, widened,
};
use crate::{
    Error, Report, Route, Sample,
    trajectory::{parts, switches},
};
use plotters::{prelude::*, style::text_anchor::HPos};

const WIDTH: i32 = 1200 * PIXEL;
const LEFT: i32 = 100 * PIXEL;
const LEGEND: i32 = 240 * PIXEL;
const PANEL: i32 = 240 * PIXEL;
const STRIP: i32 = 32 * PIXEL;
/// Room for the name above each panel.
const NAME: i32 = 44 * PIXEL;
const AXIS: i32 = 58 * PIXEL;
/// Free space around the outer names of axes.
const EDGE: i32 = 16 * PIXEL;
const X: RGBColor = RGBColor(17, 119, 51);
const Y: RGBColor = RGBColor(136, 34, 136);

pub(crate) fn timeline(report: &Report) -> Result<String, Error> {
    let robots: Vec<Robot> = report
        .trajectory
        .robots()
        .into_iter()
        .map(|name| {
            let is_scripted = report.scene.scripted.iter().any(|scripted| scripted == name);
            Robot { name, is_scripted, samples: report.trajectory.of(name) }
        })
        .collect();
    let heights: i32 = robots.iter().map(Robot::height).sum();
    image((LEFT + WIDTH + LEGEND, TITLE_HEIGHT + heights + AXIS + EDGE), |canvas| {
        draw(canvas, report, &robots)
    })
}

struct Robot<'a> {
    name: &'a str,
    is_scripted: bool,
    samples: Vec<&'a Sample>,
}

impl Robot<'_> {
    fn height(&self) -> i32 {
        NAME + PANEL + if self.is_scripted { 0 } else { STRIP }
    }
}

fn draw(canvas: &Canvas, report: &Report, robots: &[Robot]) -> Result<(), Error> {
    let (mut first, mut last) = (u64::MAX, 0);
    for sample in &report.trajectory.samples {
        first = first.min(sample.time);
        last = last.max(sample.time);
    }
    let seconds = (first.min(last) as f64 / 1e9, last as f64 / 1e9);
    let time = widened(seconds, 0.01);

    canvas.title(&report.summary.title(), &report.summary.caption())?;
    if robots.is_empty() {
        return canvas.text("no samples", (20 * PIXEL, TITLE_HEIGHT), 22, FAINT, HPos::Left);
    }
    let mut top = TITLE_HEIGHT;
    for robot in robots {
        panel(canvas, robot, time, top + NAME)?;
        if !robot.is_scripted {
            strip(canvas, robot, time, top + NAME + PANEL)?;
        }
        top += robot.height();
    }
    time_axis(canvas, time, top)
}

/// x and y of one robot.
fn panel(canvas: &Canvas, robot: &Robot, time: (f64, f64), top: i32) -> Result<(), Error> {
    let mut extent = Extent::default();
    for sample in &robot.samples {
        extent.include(sample.x);
        extent.include(sample.y);
    }
    let metres = extent.padded(0.06, 0.1);
    let area = canvas.area.clone().shrink((EDGE, top), (LEFT - EDGE + WIDTH, PANEL));
    let mut chart = ChartBuilder::on(&area)
        .y_label_area_size(LEFT - EDGE)
        .build_cartesian_2d(time.0..time.1, metres.0..metres.1)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .y_desc("[m]")
        .x_labels(12)
        .y_labels(5)
        .y_label_formatter(&|value| axis_label(*value, metres.1 - metres.0))
        .label_style(font(20))
        .axis_desc_style(font(20))
        .axis_style(stroke(FAINT, 1))
        .set_all_tick_mark_size(5 * PIXEL)
        .bold_line_style(stroke(GRID, 1))
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(failed)?;

    let pixel = |sample: &Sample, value: f64| -> Option<Pixel> {
        drawable(value).then(|| {
            let up = (value - metres.0) / (metres.1 - metres.0) * f64::from(PANEL);
            (column(sample.seconds(), time), top + PANEL - up.round() as i32)
        })
    };
    for (color, value) in [(X, (|sample| sample.x) as fn(&Sample) -> f64), (Y, |sample| sample.y)] {
        let points: Vec<Option<Pixel>> =
            robot.samples.iter().map(|sample| pixel(sample, value(sample))).collect();
        canvas.trace(&points, color, 3)?;
    }
    let script = if robot.is_scripted { " (scripted)" } else { "" };
    canvas.text(&format!("{}{script}", robot.name), (LEFT, top - 20 * PIXEL), 24, INK, HPos::Left)?;
    let entries = [(Mark::Line(X, 3), "x".to_owned()), (Mark::Line(Y, 3), "y".to_owned())];
    canvas.legend((LEFT + WIDTH + 16 * PIXEL, top + 20 * PIXEL), &entries)
}

/// The route of one robot, as coloured bands.
fn strip(canvas: &Canvas, robot: &Robot, time: (f64, f64), top: i32) -> Result<(), Error> {
    for (route, samples) in parts(&robot.samples) {
        if let [first, .., last] = samples {
            let (from, to) = (column(first.seconds(), time), column(last.seconds(), time));
            canvas
                .rectangle([(from, top + 4 * PIXEL), (to, top + STRIP - 4 * PIXEL)], color(route).filled())?;
        }
    }
    for index in switches(&robot.samples) {
        let sample = robot.samples[index];
        let at = (column(sample.seconds(), time), top + STRIP / 2);
        canvas.mark(Mark::Square(color(sample.route)), at)?;
    }
    canvas.text("route", (LEFT - 12 * PIXEL, top + STRIP / 2), 20, INK, HPos::Right)?;
    let mut entries: Vec<(Mark, String)> = [Route::Deliberative, Route::Reactive]
        .map(|route| (Mark::Line(color(Some(route)), 12), route.name().to_owned()))
        .into();
    if has_route(&robot.samples, None) {
        entries.push((Mark::Line(color(None), 12), "no action".to_owned()));
    }
    canvas.legend((LEFT + WIDTH + 16 * PIXEL, top + STRIP / 2 - LEGEND_LINE * 3), &entries)
}

/// The axis that all panels share, below the last.
fn time_axis(canvas: &Canvas, time: (f64, f64), top: i32) -> Result<(), Error> {
    let area = canvas.area.clone().shrink((LEFT, top), (WIDTH, AXIS));
    let mut chart = ChartBuilder::on(&area)
        .x_label_area_size(AXIS)
        .build_cartesian_2d(time.0..time.1, 0.0..1.0)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc("time [s]")
        .x_labels(12)
        .x_label_formatter(&|value| axis_label(*value, time.1 - time.0))
        .label_style(font(20))
        .axis_desc_style(font(22))
        .axis_style(stroke(FAINT, 1))
        .set_all_tick_mark_size(5 * PIXEL)
        .draw()
        .map_err(failed)
}

fn column(seconds: f64, time: (f64, f64)) -> i32 {
    LEFT + ((seconds - time.0) / (time.1 - time.0) * f64::from(WIDTH)).round() as i32
}
