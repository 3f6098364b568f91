//! The world from above with the ways of the robots.

use super::{
    Extent, axis_label,
    canvas::{
        Canvas, FAINT, GRID, LEGEND_LINE, Mark, PIXEL, Pixel, TITLE_HEIGHT, failed, font, image, stroke,
        text_width,
    },
    color, drawable, has_route, widened,
};
use crate::{
    Error, Report, Route, Sample, Scene,
    trajectory::{parts, switches},
};
use plotters::{prelude::*, style::text_anchor::HPos};

/// The longer side of the world.
const SIDE: i32 = 1000 * PIXEL;
const LEFT: i32 = 100 * PIXEL;
const BOTTOM: i32 = 80 * PIXEL;
/// Height of the numbers and the name of the x axis.
const LABELS: i32 = 62 * PIXEL;
/// Free space left of the name of the y axis.
const EDGE: i32 = 16 * PIXEL;
/// Room for each number of an axis.
const LABEL_SPACE: usize = 80 * PIXEL as usize;
const LEGEND: i32 = 320 * PIXEL;
const OBSTACLE: RGBColor = RGBColor(205, 205, 205);

pub(crate) fn map(report: &Report) -> Result<String, Error> {
    let (view, legend) = (View::of(report), legend(report));
    let legend_height = i32::try_from(legend.len()).unwrap_or(0) * LEGEND_LINE;
    let plot_height = if view.size.1 > legend_height { view.size.1 } else { legend_height };
    let size = (LEFT + view.size.0 + LEGEND, TITLE_HEIGHT + plot_height + BOTTOM);
    image(size, |canvas| {
        draw(canvas, report, &view)?;
        canvas.legend((LEFT + view.size.0 + 20 * PIXEL, TITLE_HEIGHT + 20 * PIXEL), &legend)
    })
}

/// The shown part of the world: metres at the edges, and the size on the canvas at one scale for both axes.
struct View {
    x: (f64, f64),
    y: (f64, f64),
    size: (i32, i32),
}

impl View {
    fn of(report: &Report) -> View {
        let (mut x, mut y) = (Extent::default(), Extent::default());
        for [point_x, point_y] in outline(report.scene) {
            x.include(point_x);
            y.include(point_y);
        }
        for sample in &report.trajectory.samples {
            x.include(sample.x);
            y.include(sample.y);
        }
        let (x, y) = (x.padded(0.03, 0.1), y.padded(0.03, 0.1));
        let (width, height) = (x.1 - x.0, y.1 - y.0);
        let longer = if width > height { width } else { height };
        // A corridor still gets a plot that is high enough to read.
        let (x, y) = (widened(x, longer * 0.4), widened(y, longer * 0.4));
        let pixels = |(low, high): (f64, f64)| ((high - low) / longer * f64::from(SIDE)).round() as i32;
        View { x, y, size: (pixels(x), pixels(y)) }
    }

    fn pixel(&self, x: f64, y: f64) -> Option<Pixel> {
        let share = |value: f64, (low, high): (f64, f64)| (value - low) / (high - low);
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        (drawable(x) && drawable(y)).then(|| {
            let right = (share(x, self.x) * width).round() as i32;
            let up = (share(y, self.y) * height).round() as i32;
            (LEFT + right, TITLE_HEIGHT + self.size.1 - up)
        })
    }

    fn pixels(&self, metres: f64) -> i32 {
        (metres / (self.x.1 - self.x.0) * f64::from(self.size.0)).round() as i32
    }
}

/// Points that together span all of the scene.
fn outline(scene: &Scene) -> impl Iterator<Item = [f64; 2]> {
    let corners = [scene.bounds.minimum, scene.bounds.maximum];
    let polygons = scene.polygons.iter().flat_map(|polygon| polygon.points.iter().copied());
    let circles = scene.circles.iter().flat_map(edges);
    let goals = scene.goals.iter().map(|goal| [goal.x, goal.y]);
    corners.into_iter().chain(polygons).chain(circles).chain(goals)
}

/// Opposite corners of the square around a circle.
fn edges(circle: &crate::Circle) -> [[f64; 2]; 2] {
    let ([x, y], radius) = (circle.center, circle.radius);
    [[x - radius, y - radius], [x + radius, y + radius]]
}

fn draw(canvas: &Canvas, report: &Report, view: &View) -> Result<(), Error> {
    canvas.title(&report.summary.title(), &report.summary.caption())?;
    axes(canvas, view)?;
    scene(canvas, view, report.scene)?;

    let robots = report.trajectory.robots();
    let is_scripted = |robot: &&str| report.scene.scripted.iter().any(|name| name == robot);
    let (scripted, framework): (Vec<&str>, Vec<&str>) = robots.into_iter().partition(is_scripted);
    for robot in &scripted {
        path(canvas, view, &report.trajectory.of(robot), BLACK, 2)?;
    }
    for robot in &framework {
        routes(canvas, view, &report.trajectory.of(robot))?;
    }
    for robot in scripted.iter().chain(&framework) {
        ends(canvas, view, robot, &report.trajectory.of(robot))?;
    }
    for goal in &report.scene.goals {
        if let Some(at) = view.pixel(goal.x, goal.y) {
            canvas.mark(Mark::Goal, at)?;
            canvas.label(&goal.label, (at.0 + 6 * PIXEL, at.1 + 30 * PIXEL))?;
        }
    }
    Ok(())
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

fn scene(canvas: &Canvas, view: &View, scene: &Scene) -> Result<(), Error> {
    for polygon in &scene.polygons {
        let corners: Option<Vec<Pixel>> = polygon.points.iter().map(|[x, y]| view.pixel(*x, *y)).collect();
        let Some(mut corners) = corners.filter(|corners| corners.len() > 1) else { continue };
        canvas.polygon(&corners, OBSTACLE)?;
        let across = |part: fn(&Pixel) -> i32| {
            let (low, high) = (corners.iter().map(part).min(), corners.iter().map(part).max());
            (low.unwrap_or(0), high.unwrap_or(0))
        };
        name(canvas, &polygon.name, across(|pixel| pixel.0), across(|pixel| pixel.1))?;
        corners.push(corners[0]);
        canvas.line(&corners, FAINT, 2)?;
    }
    for circle in &scene.circles {
        if let Some((x, y)) = view.pixel(circle.center[0], circle.center[1])
            && edges(circle).into_iter().flatten().all(drawable)
            && circle.radius > 0.0
        {
            let radius = view.pixels(circle.radius);
            canvas.circle((x, y), radius, OBSTACLE.filled())?;
            canvas.circle((x, y), radius, stroke(FAINT, 2))?;
            name(canvas, &circle.name, (x - radius, x + radius), (y - radius, y + radius))?;
        }
    }
    Ok(())
}

/// The name of an obstacle, where it fits.
fn name(
    canvas: &Canvas,
    name: &str,
    (left, right): (i32, i32),
    (top, bottom): (i32, i32),
) -> Result<(), Error> {
    const SIZE: i32 = 20;
    if text_width(name, SIZE) > right - left || SIZE * PIXEL > bottom - top {
        return Ok(());
    }
    canvas.text(name, ((left + right) / 2, (top + bottom) / 2), SIZE, FAINT, HPos::Center)
}

fn path(canvas: &Canvas, view: &View, samples: &[&Sample], color: RGBColor, width: u32) -> Result<(), Error> {
    let points: Vec<Option<Pixel>> = samples.iter().map(|sample| view.pixel(sample.x, sample.y)).collect();
    canvas.trace(&points, color, width)
}

fn routes(canvas: &Canvas, view: &View, samples: &[&Sample]) -> Result<(), Error> {
    for (route, samples) in parts(samples) {
        path(canvas, view, samples, color(route), 5)?;
    }
    for (before, sample) in samples.iter().zip(samples.iter().skip(1)) {
        if sample.action != before.action
            && !sample.action.is_empty()
            && let Some(at) = view.pixel(sample.x, sample.y)
        {
            canvas.mark(Mark::Dot(color(sample.route)), at)?;
        }
    }
    for index in switches(samples) {
        if let Some(at) = view.pixel(samples[index].x, samples[index].y) {
            canvas.mark(Mark::Square(color(samples[index].route)), at)?;
        }
    }
    Ok(())
}

fn ends(canvas: &Canvas, view: &View, robot: &str, samples: &[&Sample]) -> Result<(), Error> {
    let place = |sample: &&Sample| view.pixel(sample.x, sample.y);
    if let Some(end) = samples.last().and_then(place) {
        canvas.mark(Mark::End, end)?;
    }
    if let Some(start) = samples.first().and_then(place) {
        canvas.mark(Mark::Start, start)?;
        canvas.label(robot, start)?;
    }
    Ok(())
}

fn legend(report: &Report) -> Vec<(Mark, String)> {
    let mut entries = Vec::new();
    let mut framework = Vec::new();
    for robot in report.trajectory.robots() {
        if report.scene.scripted.iter().any(|name| name == robot) {
            entries.push((Mark::Line(BLACK, 2), format!("{robot} (scripted)")));
        } else {
            framework.extend(report.trajectory.of(robot));
        }
    }
    if !framework.is_empty() {
        for route in [Route::Deliberative, Route::Reactive] {
            entries.push((Mark::Line(color(Some(route)), 5), format!("{} route", route.name())));
        }
        if has_route(&framework, None) {
            entries.push((Mark::Line(color(None), 5), "no action".to_owned()));
        }
        entries.push((Mark::Square(color(Some(Route::Reactive))), "route changes".to_owned()));
        entries.push((Mark::Dot(color(Some(Route::Deliberative))), "next action".to_owned()));
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
