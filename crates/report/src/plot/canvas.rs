use crate::Error;
use plotters::{
    coord::Shift,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

/// Point on the canvas, from the upper left corner.
/// All lengths on the canvas are in fractions of a pixel.
pub(super) type Pixel = (i32, i32);

/// Units per pixel of the image.
/// The drawing library rounds to whole numbers, so with whole pixels the line of a slow robot would have steps.
pub(super) const PIXEL: i32 = 8;

pub(super) const INK: RGBColor = RGBColor(34, 34, 34);
pub(super) const FAINT: RGBColor = RGBColor(110, 110, 110);
pub(super) const GRID: RGBColor = RGBColor(225, 225, 225);

/// Width of the bright part of a hollow line.
pub(super) const HOLLOW_WIDTH: u32 = 2;

/// Marks of events and positions.
#[derive(Clone, Copy)]
pub(super) enum Mark {
    /// The route changed to one of this color.
    Square(RGBColor),
    /// Dot where an action of a route of this color began; radius in pixels.
    /// The shape is that of the action's kind.
    Dot(RGBColor, DotShape, i32),
    Start,
    End,
    Goal,
    /// A sample of a line, for legends.
    Line(RGBColor, u32),
    /// A sample of a line that is bright inside.
    Hollow(RGBColor, u32),
}

/// Shapes of the dots of actions, one for each kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DotShape {
    Disc,
    Triangle,
    Diamond,
    Bar,
    Wedge,
    Column,
}

impl DotShape {
    /// Returns the shape of a kind by its number; many kinds share shapes.
    pub fn of(kind: usize) -> Self {
        const ALL: [DotShape; 6] = [
            DotShape::Disc,
            DotShape::Triangle,
            DotShape::Diamond,
            DotShape::Bar,
            DotShape::Wedge,
            DotShape::Column,
        ];
        ALL[kind % ALL.len()]
    }

    /// Corners around a center, in eighths of the radius; none of a disc.
    fn corners(self) -> &'static [Pixel] {
        match self {
            DotShape::Disc => &[],
            DotShape::Triangle => &[(0, -10), (9, 7), (-9, 7)],
            DotShape::Diamond => &[(0, -10), (8, 0), (0, 10), (-8, 0)],
            DotShape::Bar => &[(-10, -4), (10, -4), (10, 4), (-10, 4)],
            DotShape::Wedge => &[(0, 10), (9, -7), (-9, -7)],
            DotShape::Column => &[(-4, -10), (4, -10), (4, 10), (-4, 10)],
        }
    }
}

/// Draws in pixels on an SVG image with white background.
pub(super) struct Canvas<'a> {
    pub area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// Returns the text of an SVG image that `draw` fills.
pub(super) fn image(size: Pixel, draw: impl FnOnce(&Canvas) -> Result<(), Error>) -> Result<String, Error> {
    let mut svg = String::new();
    let (width, height) = (size.0.unsigned_abs(), size.1.unsigned_abs());
    let canvas = Canvas { area: SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area() };
    canvas.area.fill(&WHITE).map_err(failed)?;
    draw(&canvas)?;
    canvas.area.present().map_err(failed)?;
    drop(canvas);
    // The view box keeps the fine units.
    let attributes = |width, height| format!("width=\"{width}\" height=\"{height}\"");
    let (fine, whole) = (attributes(size.0, size.1), attributes(size.0 / PIXEL, size.1 / PIXEL));
    Ok(svg.replacen(&fine, &whole, 1))
}

/// Returns the style of text of a size in pixels.
pub(super) fn font(pixels: i32) -> TextStyle<'static> {
    ("sans-serif", pixels * PIXEL).into_font().color(&INK)
}

/// Returns the style of a stroke of a width in pixels.
pub(super) fn stroke(color: RGBColor, pixels: u32) -> ShapeStyle {
    color.stroke_width(pixels * PIXEL.unsigned_abs())
}

impl Canvas<'_> {
    pub fn line(&self, points: &[Pixel], color: RGBColor, width: u32) -> Result<(), Error> {
        self.area.draw(&PathElement::new(points.to_vec(), stroke(color, width))).map_err(failed)
    }

    /// Draws a line through measured points, interrupted at missing ones.
    /// Points within a pixel are thinned out.
    pub fn trace(&self, points: &[Option<Pixel>], color: RGBColor, width: u32) -> Result<(), Error> {
        for points in points.split(Option::is_none) {
            let mut points: Vec<Pixel> = points.iter().copied().flatten().collect();
            let Some(last) = points.last().copied() else { continue };
            points.dedup_by(|next, kept| (next.0 - kept.0).abs() < PIXEL && (next.1 - kept.1).abs() < PIXEL);
            points.push(last);
            self.line(&points, color, width)?;
        }
        Ok(())
    }

    pub fn polygon(&self, points: &[Pixel], color: RGBColor) -> Result<(), Error> {
        self.area.draw(&Polygon::new(points.to_vec(), color.filled())).map_err(failed)
    }

    pub fn rectangle(&self, corners: [Pixel; 2], style: ShapeStyle) -> Result<(), Error> {
        self.area.draw(&Rectangle::new(corners, style)).map_err(failed)
    }

    pub fn circle(&self, center: Pixel, radius: i32, style: ShapeStyle) -> Result<(), Error> {
        self.area.draw(&Circle::new(center, radius, style)).map_err(failed)
    }

    pub fn text(&self, text: &str, at: Pixel, size: i32, color: RGBColor, align: HPos) -> Result<(), Error> {
        let style = font(size).color(&color).pos(Pos::new(align, VPos::Center));
        self.area.draw(&Text::new(clean(text), at, style)).map_err(failed)
    }

    /// Draws a text to the right of a place, on a ground that sets it off from lines.
    pub fn label(&self, text: &str, at: Pixel) -> Result<(), Error> {
        const SIZE: i32 = 22;
        let (left, half) = (at.0 + 14 * PIXEL, 14 * PIXEL);
        let corners = [(left, at.1 - half), (left + text_width(text, SIZE) + 6 * PIXEL, at.1 + half)];
        self.rectangle(corners, WHITE.mix(0.75).filled())?;
        self.text(text, (left + 3 * PIXEL, at.1), SIZE, INK, HPos::Left)
    }

    pub fn mark(&self, mark: Mark, at: Pixel) -> Result<(), Error> {
        /// Half the width of a goal and of a line in a legend.
        const HALF: i32 = 22 * PIXEL;
        let (x, y) = at;
        match mark {
            Mark::Square(color) => {
                let corners = |half| [(x - half, y - half), (x + half, y + half)];
                self.rectangle(corners(9 * PIXEL), INK.filled())?;
                self.rectangle(corners(8 * PIXEL), color.filled())
            }
            Mark::Dot(color, shape, radius) => self.dot(at, color, shape, radius * PIXEL),
            Mark::Start => {
                self.circle(at, 10 * PIXEL, WHITE.filled())?;
                self.circle(at, 10 * PIXEL, stroke(INK, 3))
            }
            Mark::End => self.circle(at, 9 * PIXEL, INK.filled()),
            Mark::Goal => {
                const GREEN: RGBColor = RGBColor(17, 119, 51);
                self.circle(at, 15 * PIXEL, stroke(GREEN, 3))?;
                self.line(&[(x - HALF, y), (x + HALF, y)], GREEN, 2)?;
                self.line(&[(x, y - HALF), (x, y + HALF)], GREEN, 2)
            }
            Mark::Line(color, width) => self.line(&[(x - HALF, y), (x + HALF, y)], color, width),
            Mark::Hollow(color, width) => {
                self.mark(Mark::Line(color, width), at)?;
                self.mark(Mark::Line(WHITE, HOLLOW_WIDTH), at)
            }
        }
    }

    /// Draws a dot with an edge that sets it off from the line of its color.
    fn dot(&self, at: Pixel, color: RGBColor, shape: DotShape, radius: i32) -> Result<(), Error> {
        let corners = shape.corners();
        if corners.is_empty() {
            self.circle(at, radius, color.filled())?;
            return self.circle(at, radius, stroke(WHITE, 1));
        }
        let corner = |(x, y): &Pixel| (at.0 + x * radius / 8, at.1 + y * radius / 8);
        let mut corners: Vec<Pixel> = corners.iter().map(corner).collect();
        self.polygon(&corners, color)?;
        corners.push(corners[0]);
        self.line(&corners, WHITE, 1)
    }

    /// Draws a column of marks with their meanings.
    pub fn legend(&self, at: Pixel, entries: &[(Mark, String)]) -> Result<(), Error> {
        let mut y = at.1;
        for (mark, meaning) in entries {
            self.mark(*mark, (at.0 + 24 * PIXEL, y))?;
            self.text(meaning, (at.0 + 60 * PIXEL, y), 22, INK, HPos::Left)?;
            y += LEGEND_LINE;
        }
        Ok(())
    }

    /// Draws the headline and the conditions above the plot.
    pub fn title(&self, title: &str, caption: &str) -> Result<(), Error> {
        self.text(title, (20 * PIXEL, 34 * PIXEL), 32, INK, HPos::Left)?;
        self.text(caption, (20 * PIXEL, 70 * PIXEL), 20, FAINT, HPos::Left)
    }
}

pub(super) const LEGEND_LINE: i32 = 44 * PIXEL;
pub(super) const TITLE_HEIGHT: i32 = 100 * PIXEL;

/// Returns the maximum width of a text of a size in pixels, for any usual font.
pub(super) fn text_width(text: &str, size: i32) -> i32 {
    i32::try_from(text.chars().count()).map_or(i32::MAX / 2, |count| count.saturating_mul(size * PIXEL) / 2)
}

/// Replaces control characters, which XML can't carry, not even escaped.
fn clean(text: &str) -> String {
    let allowed = |character: char| !character.is_control() && !matches!(character, '\u{fffe}' | '\u{ffff}');
    text.chars().map(|character| if allowed(character) { character } else { '\u{fffd}' }).collect()
}

pub(super) fn failed(error: impl std::fmt::Display) -> Error {
    Error::Draw(error.to_string())
}
