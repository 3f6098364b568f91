//! The world from above with the ways of the robots.

use super::{
    Drawing, axis_label,
    canvas::{
        Canvas, DotShape, FAINT, GRID, HOLLOW_WIDTH, INK, LEGEND_LINE, Mark, PIXEL, Pixel, TITLE_HEIGHT,
        failed, font, image, stroke,
    },
    color, has_route,
    view::{View, goals, obstacles},
};
use crate::{
    Error, Route, Sample,
    trajectory::{parts, switches},
};
use plotters::prelude::*;

const LEFT: i32 = 100 * PIXEL;
const BOTTOM: i32 = 80 * PIXEL;
/// Height of the numbers and the name of the x axis.
const LABELS: i32 = 62 * PIXEL;
/// Free space left of the name of the y axis.
const EDGE: i32 = 16 * PIXEL;
/// Room for each number of an axis.
const LABEL_SPACE: usize = 80 * PIXEL as usize;
const LEGEND: i32 = 320 * PIXEL;
/// Radius of a dot, pixels, and the number of dots above which it shrinks.
/// The dots are counted per robot.
const DOT_RADIUS: i32 = 6;
const MAX_LARGE_DOTS: usize = 200;
/// Maximum number of kinds of actions in the legend.
const MAX_KINDS: usize = 12;

/// Draws one run.
pub(crate) fn map(report: &Drawing) -> Result<String, Error> {
    Ok(sized(report)?.0)
}

/// Draws several runs side by side.
pub(crate) fn beside(reports: &[Drawing]) -> Result<String, Error> {
    let (mut pictures, mut size) = (String::new(), (0, 0));
    for report in reports {
        let (picture, (width, height)) = sized(report)?;
        pictures += &picture.replacen("<svg ", &format!("<svg x=\"{}\" ", size.0), 1);
        size = (size.0 + width, size.1.max(height));
    }
    let (width, height) = size;
    Ok(format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         xmlns=\"http://www.w3.org/2000/svg\">\n{pictures}</svg>\n"
    ))
}

/// Draws one run; returns also its size in whole pixels.
fn sized(report: &Drawing) -> Result<(String, Pixel), Error> {
    let points = report.trajectory.samples.iter().map(|sample| [sample.x, sample.y]);
    let (view, legend) = (View::of(report.scene, points, LEFT), legend(report));
    let legend_height = i32::try_from(legend.len()).unwrap_or(0) * LEGEND_LINE;
    let plot_height = if view.size.1 > legend_height { view.size.1 } else { legend_height };
    let size = (LEFT + view.size.0 + LEGEND, TITLE_HEIGHT + plot_height + BOTTOM);
    let picture = image(size, |canvas| {
        draw(canvas, report, &view)?;
        canvas.legend((LEFT + view.size.0 + 20 * PIXEL, TITLE_HEIGHT + 20 * PIXEL), &legend)
    })?;
    Ok((picture, (size.0 / PIXEL, size.1 / PIXEL)))
}

/// Returns the kinds of actions in order of their first dot, each with its route.
/// Actions of scripted robots are left out.
fn kinds<'a>(report: &'a Drawing) -> Vec<(&'a str, Option<Route>)> {
    let mut kinds: Vec<(&str, Option<Route>)> = Vec::new();
    for robot in report.trajectory.robots() {
        if report.scene.scripted.iter().any(|name| name == robot) {
            continue;
        }
        for sample in begun(&report.trajectory.of(robot)) {
            if !kinds.iter().any(|(kind, _)| *kind == sample.kind()) {
                kinds.push((sample.kind(), sample.route));
            }
        }
    }
    kinds
}

/// Returns the samples at which another action begins.
fn begun<'a>(samples: &[&'a Sample]) -> impl Iterator<Item = &'a Sample> {
    let pairs: Vec<_> =
        samples.iter().zip(samples.iter().skip(1)).map(|(before, now)| (*before, *now)).collect();
    let another = |(before, now): &(&Sample, &Sample)| now.action != before.action && !now.action.is_empty();
    pairs.into_iter().filter(another).map(|(_, now)| now)
}

fn draw(canvas: &Canvas, report: &Drawing, view: &View) -> Result<(), Error> {
    canvas.title(&report.title, &report.caption)?;
    axes(canvas, view)?;
    obstacles(canvas, view, report.scene)?;

    let robots = report.trajectory.robots();
    let is_scripted = |robot: &&str| report.scene.scripted.iter().any(|name| name == robot);
    let (scripted, framework): (Vec<&str>, Vec<&str>) = robots.into_iter().partition(is_scripted);
    for robot in &scripted {
        path(canvas, view, &report.trajectory.of(robot), BLACK, 2)?;
    }
    let kinds = kinds(report);
    for (index, robot) in framework.iter().enumerate() {
        routes(canvas, view, &report.trajectory.of(robot), &kinds, index > 0)?;
    }
    for robot in scripted.iter().chain(&framework) {
        ends(canvas, view, robot, &report.trajectory.of(robot))?;
    }
    goals(canvas, view, report.scene)
}

fn axes(canvas: &Canvas, view: &View) -> Result<(), Error> {
    let plot =
        canvas.area.clone().shrink((EDGE, TITLE_HEIGHT), (LEFT - EDGE + view.size.0, view.size.1 + LABELS));
    let mut chart = ChartBuilder::on(&plot)
        .x_label_area_size(LABELS)
        .y_label_area_size(LEFT - EDGE)
        .build_cartesian_2d(view.x.0..view.x.1, view.y.0..view.y.1)
        .map_err(failed)?;
    let (width, height) = (view.x.1 - view.x.0, view.y.1 - view.y.0);
    chart
        .configure_mesh()
        .x_desc("x [m]")
        .y_desc("y [m]")
        .x_labels(view.size.0.unsigned_abs() as usize / LABEL_SPACE)
        .y_labels(view.size.1.unsigned_abs() as usize / LABEL_SPACE)
        .x_label_formatter(&|value| axis_label(*value, width))
        .y_label_formatter(&|value| axis_label(*value, height))
        .label_style(font(20))
        .axis_desc_style(font(22))
        .axis_style(stroke(FAINT, 1))
        .set_all_tick_mark_size(5 * PIXEL)
        .bold_line_style(stroke(GRID, 1))
        .light_line_style(TRANSPARENT)
        .draw()
        .map_err(failed)
}

fn path(canvas: &Canvas, view: &View, samples: &[&Sample], color: RGBColor, width: u32) -> Result<(), Error> {
    let points: Vec<Option<Pixel>> = samples.iter().map(|sample| view.pixel(sample.x, sample.y)).collect();
    canvas.trace(&points, color, width)
}

/// Draws the path of a robot in the colors of its routes.
/// Hollow lines tell the other robots from the first.
fn routes(
    canvas: &Canvas,
    view: &View,
    samples: &[&Sample],
    kinds: &[(&str, Option<Route>)],
    is_hollow: bool,
) -> Result<(), Error> {
    for (route, samples) in parts(samples) {
        path(canvas, view, samples, color(route), 5)?;
    }
    if is_hollow {
        path(canvas, view, samples, WHITE, HOLLOW_WIDTH)?;
    }
    for index in switches(samples) {
        if let Some(at) = view.pixel(samples[index].x, samples[index].y) {
            canvas.mark(Mark::Square(color(samples[index].route)), at)?;
        }
    }
    // Many dots would hide the line.
    let radius = if begun(samples).count() > MAX_LARGE_DOTS { 3 } else { DOT_RADIUS };
    for sample in begun(samples) {
        if let Some(at) = view.pixel(sample.x, sample.y) {
            let kind = kinds.iter().position(|(kind, _)| *kind == sample.kind());
            canvas
                .mark(Mark::Dot(color(sample.route), DotShape::of(kind.unwrap_or_default()), radius), at)?;
        }
    }
    Ok(())
}

fn ends(canvas: &Canvas, view: &View, robot: &str, samples: &[&Sample]) -> Result<(), Error> {
    let pixel = |sample: &&Sample| view.pixel(sample.x, sample.y);
    if let Some(end) = samples.last().and_then(pixel) {
        canvas.mark(Mark::End, end)?;
    }
    if let Some(start) = samples.first().and_then(pixel) {
        canvas.mark(Mark::Start, start)?;
        canvas.label(robot, start)?;
    }
    Ok(())
}

fn legend(report: &Drawing) -> Vec<(Mark, String)> {
    let mut entries = Vec::new();
    let (mut framework, mut names) = (Vec::new(), Vec::new());
    for robot in report.trajectory.robots() {
        if report.scene.scripted.iter().any(|name| name == robot) {
            entries.push((Mark::Line(BLACK, 2), format!("{robot} (scripted)")));
        } else {
            framework.extend(report.trajectory.of(robot));
            names.push(robot);
        }
    }
    if names.len() > 1 {
        let line = |index| if index == 0 { Mark::Line(INK, 5) } else { Mark::Hollow(INK, 5) };
        entries.extend(names.into_iter().enumerate().map(|(index, name)| (line(index), name.to_owned())));
    }
    if !framework.is_empty() {
        for route in [Route::Deliberative, Route::Reactive] {
            entries.push((Mark::Line(color(Some(route)), 5), format!("{} route", route.name())));
        }
        if has_route(&framework, None) {
            entries.push((Mark::Line(color(None), 5), "no action".to_owned()));
        }
        entries.push((Mark::Square(color(Some(Route::Reactive))), "route changes".to_owned()));
        let kinds = kinds(report);
        // Files of others have any number of kinds.
        let dots = kinds.iter().take(MAX_KINDS).enumerate();
        entries.extend(dots.map(|(number, (kind, route))| {
            (Mark::Dot(color(*route), DotShape::of(number), DOT_RADIUS), format!("{kind} begins"))
        }));
        if kinds.len() > MAX_KINDS {
            let rest = kinds.len() - MAX_KINDS;
            entries.push((Mark::Dot(INK, DotShape::Disc, DOT_RADIUS), format!("and {rest} other kinds")));
        }
    }
    if !report.trajectory.samples.is_empty() {
        entries.push((Mark::Start, "start".to_owned()));
        entries.push((Mark::End, "end".to_owned()));
    }
    if !report.scene.goals.is_empty() {
        entries.push((Mark::Goal, "goal".to_owned()));
    }
    entries
}
