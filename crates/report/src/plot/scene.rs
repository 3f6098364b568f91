//! World from above at the start of a run, with the robots.

use super::{
    Drawing,
    canvas::{Canvas, FAINT, INK, LEGEND_LINE, Mark, PIXEL, Pixel, TITLE_HEIGHT, failed, image},
    palette,
    view::{View, goals, obstacles},
    visibility::visible,
};
use crate::{Error, Robot};
use plotters::{prelude::*, style::text_anchor::HPos};

const LEFT: i32 = 20 * PIXEL;
/// Room for the scale below the world.
const BOTTOM: i32 = 80 * PIXEL;
const LEGEND: i32 = 320 * PIXEL;
const CONE: RGBColor = RGBColor(221, 170, 51);

pub(crate) fn scene(report: &Drawing) -> Result<String, Error> {
    let scene = report.scene;
    let cones: Vec<Vec<[f64; 2]>> = scene
        .robots
        .iter()
        .flat_map(|robot| robot.cones.iter().map(|cone| visible(scene, robot, cone)))
        .collect();
    let bodies = scene.robots.iter().flat_map(|robot| {
        let outline = robot.outline.iter().map(|point| robot.to_world(*point));
        outline.chain([[robot.x, robot.y]])
    });
    let view = View::of(scene, cones.iter().flatten().copied().chain(bodies), LEFT);
    let legend = legend(report);
    let legend_height = i32::try_from(legend.len()).unwrap_or(0) * LEGEND_LINE;
    let height = TITLE_HEIGHT + view.size.1.max(legend_height) + BOTTOM;
    let size = (LEFT + view.size.0 + LEGEND, height);
    image(size, |canvas| {
        canvas.title(&report.title, &report.caption)?;
        if scene.robots.is_empty() && scene.polygons.is_empty() && scene.circles.is_empty() {
            // Such as that of a real robot.
            return canvas.text("the world is not described", (LEFT, TITLE_HEIGHT), 22, FAINT, HPos::Left);
        }
        for cone in &cones {
            fill(canvas, &view, cone, CONE.mix(0.13))?;
        }
        obstacles(canvas, &view, scene)?;
        let colors = palette(report);
        for robot in &scene.robots {
            body(canvas, &view, robot, colors.get(robot.name.as_str()).copied().unwrap_or(INK))?;
        }
        // A robot may stand on a goal.
        goals(canvas, &view, scene)?;
        scene.robots.iter().try_for_each(|robot| name(canvas, &view, robot))?;
        scale(canvas, &view)?;
        canvas.legend((LEFT + view.size.0 + 20 * PIXEL, TITLE_HEIGHT + 20 * PIXEL), &legend)
    })
}

fn body(canvas: &Canvas, view: &View, robot: &Robot, color: RGBColor) -> Result<(), Error> {
    let placed = |points: &[[f64; 2]]| points.iter().map(|point| robot.to_world(*point)).collect::<Vec<_>>();
    let outline = placed(&robot.outline);
    fill(canvas, view, &outline, WHITE.to_rgba())?;
    fill(canvas, view, &outline, color.mix(0.35))?;
    for [[back, right], [front, left]] in robot.wheels.iter().copied() {
        let corners = placed(&[[back, right], [front, right], [front, left], [back, left]]);
        fill(canvas, view, &corners, INK.to_rgba())?;
    }
    if let Some(mut corners) = pixels(view, &outline) {
        corners.extend(corners.first().copied());
        canvas.line(&corners, color, 3)?;
    }
    // The arrow ends at the front of the body.
    let front = robot.outline.iter().map(|[x, _]| *x).fold(0.0, |most, x| if x > most { x } else { most });
    let arrow = [[front, 0.0], [front * 0.3, front * 0.45], [front * 0.3, -front * 0.45]];
    fill(canvas, view, &placed(&arrow), color.to_rgba())
}

/// Draws the name on the right of the robot.
fn name(canvas: &Canvas, view: &View, robot: &Robot) -> Result<(), Error> {
    let Some((x, y)) = view.pixel(robot.x, robot.y) else { return Ok(()) };
    let corners = robot.outline.iter().map(|corner| robot.to_world(*corner));
    let right = corners.filter_map(|[x, y]| view.pixel(x, y)).map(|corner| corner.0).fold(x, i32::max);
    canvas.label(&robot.name, (right - 8 * PIXEL, y))
}

/// Draws a scale bar of a round length, below the world.
fn scale(canvas: &Canvas, view: &View) -> Result<(), Error> {
    let most = (view.x.1 - view.x.0) / 3.0;
    let decade = libm::exp10(libm::floor(libm::log10(most)));
    let meters = [5.0, 2.0].map(|factor| factor * decade).into_iter().find(|length| *length <= most);
    let meters = meters.unwrap_or(decade);
    let (left, y) = (LEFT + 4 * PIXEL, TITLE_HEIGHT + view.size.1 + 36 * PIXEL);
    let right = left + view.pixels(meters);
    canvas.line(&[(left, y), (right, y)], INK, 3)?;
    for end in [left, right] {
        canvas.line(&[(end, y - 8 * PIXEL), (end, y + 8 * PIXEL)], INK, 3)?;
    }
    canvas.text(&format!("{meters} m"), (right + 14 * PIXEL, y), 22, INK, HPos::Left)
}

fn fill(canvas: &Canvas, view: &View, points: &[[f64; 2]], color: RGBAColor) -> Result<(), Error> {
    let Some(points) = pixels(view, points).filter(|points| points.len() > 2) else { return Ok(()) };
    canvas.area.draw(&Polygon::new(points, color.filled())).map_err(failed)
}

fn pixels(view: &View, points: &[[f64; 2]]) -> Option<Vec<Pixel>> {
    points.iter().map(|[x, y]| view.pixel(*x, *y)).collect()
}

fn legend(report: &Drawing) -> Vec<(Mark, String)> {
    let colors = palette(report);
    let robots = report.scene.robots.iter().map(|robot| {
        let is_scripted = report.scene.scripted.contains(&robot.name);
        let script = if is_scripted { " (scripted)" } else { "" };
        let color = colors.get(robot.name.as_str()).copied().unwrap_or(INK);
        (Mark::Line(color, 12), format!("{}{script}", robot.name))
    });
    let mut entries: Vec<_> = robots.collect();
    if report.scene.robots.iter().any(|robot| !robot.cones.is_empty()) {
        entries.push((Mark::Line(CONE, 12), "range sensors".to_owned()));
    }
    if !report.scene.goals.is_empty() {
        entries.push((Mark::Goal, "goal".to_owned()));
    }
    entries
}
