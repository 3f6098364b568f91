//! Animation of the run: SVG with declarative (SMIL) animation.
//! Browsers play it also inside of `<img>`.

use super::{
    Drawing,
    canvas::{Canvas, INK, LEGEND_LINE, Mark, PIXEL, Pixel, TITLE_HEIGHT, image},
    color, has_route, palette,
    view::{View, goals, obstacles},
};
use crate::{Error, Route, Sample, trajectory::parts};
use plotters::prelude::*;
use std::fmt::Write;

const LEFT: i32 = 20 * PIXEL;
const BOTTOM: i32 = 20 * PIXEL;
const LEGEND: i32 = 320 * PIXEL;
/// Seconds that the picture plays at most; longer runs play faster than they were.
const MAX_DURATION: f64 = 20.0;
/// Seconds that the end stays before the picture begins again.
const END_PAUSE: f64 = 2.0;
/// Poses a second of playing, between which the browser interpolates.
const FRAMES_PER_SECOND: f64 = 10.0;
/// Seconds of playing after which the next piece of a trail appears.
const TRAIL_PERIOD: f64 = 0.25;

/// Draws the trajectories as an animation that repeats for ever.
/// Viewers without animation show a still of the end.
pub(crate) fn animation(report: &Drawing) -> Result<String, Error> {
    let points = report.trajectory.samples.iter().map(|sample| [sample.x, sample.y]);
    let view = View::of(report.scene, points, LEFT);
    let legend = legend(report);
    let legend_height = i32::try_from(legend.len()).unwrap_or(0) * LEGEND_LINE;
    let size = (LEFT + view.size.0 + LEGEND, TITLE_HEIGHT + view.size.1.max(legend_height) + BOTTOM);
    let pace = Pace::of(&report.trajectory.samples);
    let title = match pace.speed {
        speed if speed > 1.0 => format!("{} ({speed:.0} times as fast)", report.title),
        _ => report.title.clone(),
    };
    let mut svg = image(size, |canvas| background(canvas, report, &view, &title, &legend))?;
    let end = svg.rfind("</svg>").unwrap_or(svg.len());
    svg.insert_str(end, &moving(report, &view, &pace));
    Ok(svg)
}

fn background(
    canvas: &Canvas,
    report: &Drawing,
    view: &View,
    title: &str,
    legend: &[(Mark, String)],
) -> Result<(), Error> {
    canvas.title(title, &report.caption)?;
    obstacles(canvas, view, report.scene)?;
    goals(canvas, view, report.scene)?;
    canvas.legend((LEFT + view.size.0 + 20 * PIXEL, TITLE_HEIGHT + 20 * PIXEL), legend)
}

fn legend(report: &Drawing) -> Vec<(Mark, String)> {
    let colors = palette(report);
    let robots = report.trajectory.robots();
    let mut entries: Vec<_> = robots
        .iter()
        .map(|name| {
            let is_scripted = report.scene.scripted.iter().any(|scripted| scripted == name);
            let script = if is_scripted { " (scripted)" } else { "" };
            (Mark::Line(colors.get(name).copied().unwrap_or(INK), 12), format!("{name}{script}"))
        })
        .collect();
    let samples: Vec<&Sample> = report.trajectory.samples.iter().collect();
    for route in [Route::Deliberative, Route::Reactive] {
        if has_route(&samples, Some(route)) {
            entries.push((Mark::Line(color(Some(route)), 5), format!("{} route", route.name())));
        }
    }
    entries
}

/// Mapping from the time of the run to the time of the animation.
struct Pace {
    /// Seconds since the start of the run.
    first: f64,
    /// Seconds of the run in a second of playing.
    speed: f64,
    /// Seconds until the picture begins again.
    total: f64,
}

impl Pace {
    fn of(samples: &[Sample]) -> Pace {
        let first = samples.iter().map(|sample| sample.time).min().unwrap_or(0) as f64 / 1e9;
        let last = samples.iter().map(|sample| sample.time).max().unwrap_or(0) as f64 / 1e9;
        let duration = last - first;
        let speed = if duration > MAX_DURATION { libm::ceil(duration / MAX_DURATION) } else { 1.0 };
        Pace { first, speed, total: duration / speed + END_PAUSE }
    }

    /// Returns the time of a sample as a share of the animation, 0 to 1.
    fn share(&self, sample: &Sample) -> f64 {
        (sample.seconds() - self.first) / self.speed / self.total
    }

    /// Attributes that all animations share.
    fn repeat(&self) -> String {
        format!("dur=\"{:.2}s\" repeatCount=\"indefinite\"", self.total)
    }
}

/// Draws the trails, and the robots above them.
fn moving(report: &Drawing, view: &View, pace: &Pace) -> String {
    let (mut text, colors) = (String::new(), palette(report));
    let robots = report.trajectory.robots();
    for name in &robots {
        let fallback = colors.get(name).copied().unwrap_or(INK);
        trail(&mut text, view, pace, &report.trajectory.of(name), fallback);
    }
    for name in &robots {
        let outline =
            report.scene.robots.iter().find(|robot| robot.name == *name).map(|robot| &robot.outline[..]);
        let fallback = colors.get(name).copied().unwrap_or(INK);
        body(&mut text, view, pace, &report.trajectory.of(name), outline.unwrap_or_default(), fallback);
    }
    text
}

/// Pieces of the way, each of which appears when the robot has driven it.
fn trail(text: &mut String, view: &View, pace: &Pace, samples: &[&Sample], fallback: RGBColor) {
    for (route, part) in parts(samples) {
        let color = hex(route.map_or(fallback, |route| color(Some(route))));
        let mut rest = part;
        while rest.len() > 1 {
            let begin = rest[0].seconds();
            let within = |sample: &&&Sample| sample.seconds() - begin <= TRAIL_PERIOD * pace.speed;
            let length = rest.iter().take_while(within).count().max(2);
            let (piece, share) = (&rest[..length], pace.share(rest[length - 1]));
            rest = &rest[length - 1..];
            let mut points: Vec<Pixel> =
                piece.iter().filter_map(|sample| view.pixel(sample.x, sample.y)).collect();
            points.dedup_by(|next, kept| (next.0 - kept.0).abs() < PIXEL && (next.1 - kept.1).abs() < PIXEL);
            if points.len() < 2 {
                continue;
            }
            let points: Vec<String> = points.iter().map(|(x, y)| format!("{x},{y}")).collect();
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "<polyline fill=\"none\" stroke=\"{color}\" stroke-width=\"{}\" points=\"{}\"><animate \
                 attributeName=\"visibility\" values=\"hidden;visible\" keyTimes=\"0;{share:.4}\" \
                 calcMode=\"discrete\" {}/></polyline>",
                4 * PIXEL,
                points.join(" "),
                pace.repeat(),
            );
        }
    }
}

/// Draws a robot with an arrow to its front, in the color of its route.
/// The route is the one that commands it.
fn body(
    text: &mut String,
    view: &View,
    pace: &Pace,
    samples: &[&Sample],
    outline: &[[f64; 2]],
    fallback: RGBColor,
) {
    let poses = poses(view, pace, samples);
    let Some((translation, rotation)) = poses.last().cloned() else { return };
    let column = |part: fn(&(String, String)) -> &str| poses.iter().map(part).collect::<Vec<_>>().join(";");
    let animate = |kind: &str, values: String| {
        let repeat = pace.repeat();
        format!(
            "<animateTransform attributeName=\"transform\" type=\"{kind}\" values=\"{values}\" {repeat}/>"
        )
    };
    let circle: Vec<[f64; 2]> = (0..16)
        .map(|corner| f64::from(corner) * std::f64::consts::TAU / 16.0)
        .map(|angle| [0.15 * libm::cos(angle), 0.15 * libm::sin(angle)])
        .collect();
    let outline = if outline.len() > 2 { outline } else { &circle };
    let points = |corners: &[[f64; 2]]| {
        let corner = |[x, y]: &[f64; 2]| format!("{},{}", view.pixels(*x), -view.pixels(*y));
        corners.iter().map(corner).collect::<Vec<_>>().join(" ")
    };
    let front = outline.iter().map(|[x, _]| *x).fold(0.0, |most, x| if x > most { x } else { most });
    let arrow = [[front, 0.0], [front * 0.3, front * 0.45], [front * 0.3, -front * 0.45]];
    let _ = writeln!(
        text,
        "<g transform=\"translate({translation})\">{}<g transform=\"rotate({rotation})\">{}<polygon stroke=\"{}\" \
         stroke-width=\"{}\" fill-opacity=\"0.8\" fill=\"{}\" points=\"{}\">{}</polygon><polygon fill=\"#fff\" \
         points=\"{}\"/></g></g>",
        animate("translate", column(|pose| &pose.0)),
        animate("rotate", column(|pose| &pose.1)),
        hex(INK),
        2 * PIXEL,
        hex(fallback),
        points(outline),
        colors(pace, samples, fallback),
        points(&arrow),
    );
}

/// Returns position and rotation of a robot in each frame.
/// The robot stays where its pose can't be drawn.
fn poses(view: &View, pace: &Pace, samples: &[&Sample]) -> Vec<(String, String)> {
    let frames = libm::ceil(pace.total * FRAMES_PER_SECOND) as u32;
    let drawable: Vec<(&Sample, Pixel)> = samples
        .iter()
        .filter(|sample| sample.theta.is_finite())
        .filter_map(|sample| view.pixel(sample.x, sample.y).map(|at| (*sample, at)))
        .collect();
    let (mut index, mut rotation, mut poses) = (0, None::<f64>, Vec::new());
    if drawable.is_empty() {
        return poses;
    }
    for frame in 0..=frames {
        let share = f64::from(frame) / f64::from(frames);
        while index + 1 < drawable.len() && pace.share(drawable[index + 1].0) <= share {
            index += 1;
        }
        let (sample, (x, y)) = drawable[index];
        // Counter-clockwise in the world is negative on a canvas whose y points down. The short way round is taken.
        let wanted = -sample.theta * 180.0 / std::f64::consts::PI;
        let last = rotation.unwrap_or(wanted);
        let next = wanted - 360.0 * libm::round((wanted - last) / 360.0);
        rotation = Some(next);
        poses.push((format!("{x},{y}"), format!("{next:.1}")));
    }
    poses
}

/// Returns the animated colors of a robot as its routes change.
fn colors(pace: &Pace, samples: &[&Sample], fallback: RGBColor) -> String {
    let changes: Vec<(f64, String)> = parts(samples)
        .map(|(route, part)| (pace.share(part[0]), hex(route.map_or(fallback, |route| color(Some(route))))))
        .collect();
    if changes.len() < 2 {
        return String::new();
    }
    let values: Vec<&str> = changes.iter().map(|(_, color)| color.as_str()).collect();
    let times: Vec<String> = changes
        .iter()
        .enumerate()
        .map(|(index, (share, _))| if index == 0 { "0".to_owned() } else { format!("{share:.4}") })
        .collect();
    format!(
        "<animate attributeName=\"fill\" values=\"{}\" keyTimes=\"{}\" calcMode=\"discrete\" {}/>",
        values.join(";"),
        times.join(";"),
        pace.repeat(),
    )
}

fn hex(color: RGBColor) -> String {
    format!("#{:02x}{:02x}{:02x}", color.0, color.1, color.2)
}
