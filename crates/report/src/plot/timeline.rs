//! Positions and routes of all robots over time.

use super::{
    Drawing, Extent, axis_label,
    canvas::{
        Canvas, FAINT, GRID, INK, LEGEND_LINE, Mark, PIXEL, Pixel, TITLE_HEIGHT, failed, font, image, stroke,
    },
    color, drawable, has_route, palette, widened,
};
use crate::{
    Error, Route, Sample,
    trajectory::{parts, switches},
};
use plotters::{prelude::*, style::text_anchor::HPos};

const WIDTH: i32 = 1200 * PIXEL;
const LEFT: i32 = 100 * PIXEL;
const LEGEND: i32 = 240 * PIXEL;
const PANEL: i32 = 260 * PIXEL;
const STRIP: i32 = 40 * PIXEL;
/// Room between panels.
const GAP: i32 = 24 * PIXEL;
const AXIS: i32 = 58 * PIXEL;
/// Free space around the outer names of axes.
const EDGE: i32 = 16 * PIXEL;

pub(crate) fn timeline(report: &Drawing) -> Result<String, Error> {
    let colors = palette(report);
    let robots: Vec<RobotStrip> = report
        .trajectory
        .robots()
        .into_iter()
        .map(|name| RobotStrip {
            name,
            color: colors.get(name).copied().unwrap_or(INK),
            is_scripted: report.scene.scripted.iter().any(|scripted| scripted == name),
            samples: report.trajectory.of(name),
        })
        .collect();
    let controlled = robots.iter().filter(|robot| !robot.is_scripted).count();
    let strips = i32::try_from(controlled).unwrap_or(0) * STRIP;
    // Many robots have a legend that is higher than their panels; the routes have the last lines of it.
    let lines = i32::try_from(robots.len()).unwrap_or(0) + 5;
    let panels = (2 * (PANEL + GAP) + strips + AXIS).max(lines * LEGEND_LINE);
    image((LEFT + WIDTH + LEGEND, TITLE_HEIGHT + panels + EDGE), |canvas| draw(canvas, report, &robots))
}

struct RobotStrip<'a> {
    name: &'a str,
    color: RGBColor,
    is_scripted: bool,
    samples: Vec<&'a Sample>,
}

fn draw(canvas: &Canvas, report: &Drawing, robots: &[RobotStrip]) -> Result<(), Error> {
    let (mut first, mut last) = (u64::MAX, 0);
    for sample in &report.trajectory.samples {
        first = first.min(sample.time);
        last = last.max(sample.time);
    }
    let seconds = (first.min(last) as f64 / 1e9, last as f64 / 1e9);
    let time = widened(seconds, 0.01);

    canvas.title(&report.title, &report.caption)?;
    if robots.is_empty() {
        return canvas.text("no samples", (20 * PIXEL, TITLE_HEIGHT), 22, FAINT, HPos::Left);
    }
    let mut top = TITLE_HEIGHT;
    panel(canvas, robots, ("x [m]", |sample| sample.x), time, top)?;
    top += PANEL + GAP;
    panel(canvas, robots, ("y [m]", |sample| sample.y), time, top)?;
    top += PANEL + GAP;
    for robot in robots.iter().filter(|robot| !robot.is_scripted) {
        strip(canvas, robot, time, top)?;
        top += STRIP;
    }
    legends(canvas, robots)?;
    time_axis(canvas, time, top)
}

/// Draws one coordinate of all robots.
fn panel(
    canvas: &Canvas,
    robots: &[RobotStrip],
    (name, value): (&str, fn(&Sample) -> f64),
    time: (f64, f64),
    top: i32,
) -> Result<(), Error> {
    let mut extent = Extent::default();
    robots.iter().flat_map(|robot| &robot.samples).for_each(|sample| extent.include(value(sample)));
    let meters = extent.padded(0.06, 0.1);
    let area = canvas.area.clone().shrink((EDGE, top), (LEFT - EDGE + WIDTH, PANEL));
    let mut chart = ChartBuilder::on(&area)
        .y_label_area_size(LEFT - EDGE)
        .build_cartesian_2d(time.0..time.1, meters.0..meters.1)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .y_desc(name)
        .x_labels(12)
        .y_labels(5)
        .y_label_formatter(&|value| axis_label(*value, meters.1 - meters.0))
        .label_style(font(20))
        .axis_desc_style(font(22))
        .axis_style(stroke(FAINT, 1))
        .set_all_tick_mark_size(5 * PIXEL)
        .bold_line_style(stroke(GRID, 1))
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(failed)?;

    let pixel = |sample: &Sample| -> Option<Pixel> {
        drawable(value(sample)).then(|| {
            let up = (value(sample) - meters.0) / (meters.1 - meters.0) * f64::from(PANEL);
            (column(sample.seconds(), time), top + PANEL - up.round() as i32)
        })
    };
    // Those that the run is about are above the others.
    let (scripted, controlled): (Vec<&RobotStrip>, Vec<&RobotStrip>) =
        robots.iter().partition(|robot| robot.is_scripted);
    for robot in scripted.into_iter().chain(controlled) {
        let points: Vec<Option<Pixel>> = robot.samples.iter().map(|sample| pixel(sample)).collect();
        canvas.trace(&points, robot.color, robot.width())?;
    }
    Ok(())
}

impl RobotStrip<'_> {
    /// Returns the width of the robot's line.
    fn width(&self) -> u32 {
        if self.is_scripted { 2 } else { 4 }
    }
}

/// Draws the route of one robot, as colored bands.
fn strip(canvas: &Canvas, robot: &RobotStrip, time: (f64, f64), top: i32) -> Result<(), Error> {
    for (route, samples) in parts(&robot.samples) {
        if let [first, .., last] = samples {
            let (from, to) = (column(first.seconds(), time), column(last.seconds(), time));
            canvas
                .rectangle([(from, top + 6 * PIXEL), (to, top + STRIP - 6 * PIXEL)], color(route).filled())?;
        }
    }
    for index in switches(&robot.samples) {
        let sample = robot.samples[index];
        let at = (column(sample.seconds(), time), top + STRIP / 2);
        canvas.mark(Mark::Square(color(sample.route)), at)?;
    }
    canvas.text(robot.name, (LEFT - 12 * PIXEL, top + STRIP / 2), 22, INK, HPos::Right)
}

/// Draws the legends to the right of the panels.
/// These are the robots, and below them the routes, if any robot has some.
fn legends(canvas: &Canvas, robots: &[RobotStrip]) -> Result<(), Error> {
    let names = robots.iter().map(|robot| {
        let script = if robot.is_scripted { " (scripted)" } else { "" };
        (Mark::Line(robot.color, robot.width()), format!("{}{script}", robot.name))
    });
    let names: Vec<_> = names.collect();
    let left = LEFT + WIDTH + 16 * PIXEL;
    canvas.legend((left, TITLE_HEIGHT + 20 * PIXEL), &names)?;
    let controlled = || robots.iter().filter(|robot| !robot.is_scripted);
    if controlled().next().is_none() {
        return Ok(());
    }
    let mut routes: Vec<(Mark, String)> = [Route::Deliberative, Route::Reactive]
        .map(|route| (Mark::Line(color(Some(route)), 12), route.name().to_owned()))
        .into();
    if controlled().any(|robot| has_route(&robot.samples, None)) {
        routes.push((Mark::Line(color(None), 12), "no action".to_owned()));
    }
    routes.push((Mark::Square(color(Some(Route::Reactive))), "route changes".to_owned()));
    // Beside the strips, unless there are many robots.
    let strips = TITLE_HEIGHT + 2 * (PANEL + GAP) - 2 * LEGEND_LINE;
    let below = i32::try_from(names.len()).unwrap_or(0) * LEGEND_LINE + TITLE_HEIGHT + 20 * PIXEL;
    canvas.legend((left, strips.max(below)), &routes)
}

/// Draws the axis that all panels share, below the last.
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
