/// Found person: a box in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VictimBox {
    /// Leftmost column, topmost row, rightmost column and lowest row.
    pub corners: [usize; 4],
    /// Pixels of skin that only have such neighbors.
    pub skin: usize,
    /// Pixels of clothes.
    pub clothes: usize,
}

impl VictimBox {
    /// Returns the confidence, 0 to 1; it grows with the number of pixels.
    pub fn confidence(&self) -> f64 {
        let share = |pixels: usize, half: f64| pixels as f64 / (pixels as f64 + half);
        share(self.skin, LEAST_SKIN as f64) * share(self.clothes, MIN_CLOTHES as f64)
    }
}

/// Least number of pixels of skin, without its border.
const LEAST_SKIN: usize = 14;
/// Least number of pixels of clothes.
const MIN_CLOTHES: usize = 20;
/// Pixels up to this far from each other belong together.
const CLUSTER_DISTANCE: usize = 2;
/// Darker pixels have no color.
const DARK: f32 = 28.0;

/// Class of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum PixelClass {
    #[default]
    Other,
    Skin,
    Clothes,
}

/// Detector of people by the colors of skin beside those of clothes.
///
/// Skin is where the ratios of red to green and of green to blue belong together as those of skin do, from light to dark; they
/// are the same in light and shade. Clothes are saturated. What only has skin or only clothes is no person.
#[derive(Clone, Debug, Default)]
pub struct VictimDetector {
    classes: Vec<PixelClass>,
    /// True for each pixel that belongs to a blob already.
    is_taken: Vec<bool>,
    /// Pixels that hang together.
    members: Vec<usize>,
    found: Vec<VictimBox>,
}

impl VictimDetector {
    /// Returns the people in an image, the most confident first.
    /// The image is given by its rows of red, green and blue.
    pub fn detect<'a>(&mut self, width: usize, rows: impl Iterator<Item = &'a [u8]>) -> &[VictimBox] {
        self.found.clear();
        self.classes.clear();
        rows.for_each(|row| self.classes.extend(row.chunks_exact(3).take(width).map(class)));
        let height = self.classes.len().checked_div(width).unwrap_or(0);
        self.classes.truncate(width * height);
        self.is_taken.clear();
        self.is_taken.resize(self.classes.len(), false);
        for pixel in 0..self.classes.len() {
            if self.classes[pixel] != PixelClass::Other
                && !self.is_taken[pixel]
                && let Some(person) = self.take(pixel, width, height)
            {
                self.found.push(person);
            }
        }
        self.found.sort_by(|a, b| b.confidence().total_cmp(&a.confidence()));
        &self.found
    }

    /// Takes all pixels connected with one.
    /// `None` if they are no person.
    fn take(&mut self, first: usize, width: usize, height: usize) -> Option<VictimBox> {
        let mut person = VictimBox { corners: [width, height, 0, 0], skin: 0, clothes: 0 };
        self.members.clear();
        self.members.push(first);
        self.is_taken[first] = true;
        let mut at = 0;
        while at < self.members.len() {
            let pixel = self.members[at];
            at += 1;
            let (x, y) = (pixel % width, pixel / width);
            let [left, top, right, bottom] = person.corners;
            person.corners = [left.min(x), top.min(y), right.max(x), bottom.max(y)];
            match self.classes[pixel] {
                PixelClass::Skin if self.is_core(x, y, width, height) => person.skin += 1,
                PixelClass::Clothes => person.clothes += 1,
                _ => {}
            }
            for row in y.saturating_sub(CLUSTER_DISTANCE)..(y + CLUSTER_DISTANCE + 1).min(height) {
                for column in x.saturating_sub(CLUSTER_DISTANCE)..(x + CLUSTER_DISTANCE + 1).min(width) {
                    let other = row * width + column;
                    if !self.is_taken[other] && self.classes[other] != PixelClass::Other {
                        self.is_taken[other] = true;
                        self.members.push(other);
                    }
                }
            }
        }
        let is_person = person.skin >= LEAST_SKIN && person.clothes >= MIN_CLOTHES;
        is_person.then_some(person)
    }

    fn is_core(&self, x: usize, y: usize, width: usize, height: usize) -> bool {
        let is_inside = x > 0 && y > 0 && x + 1 < width && y + 1 < height;
        let middle = y * width + x;
        is_inside
            && [middle - 1, middle + 1, middle - width, middle + width]
                .iter()
                .all(|neighbor| self.classes[*neighbor] == PixelClass::Skin)
    }
}

fn class(pixel: &[u8]) -> PixelClass {
    let [red, green, blue] = [pixel[0], pixel[1], pixel[2]].map(f32::from);
    let most = if red > green { red } else { green };
    let most = if blue > most { blue } else { most };
    let least = if red < green { red } else { green };
    let least = if blue < least { blue } else { least };
    if most < DARK {
        return PixelClass::Other;
    }
    let (by_green, by_blue) = (red / (green + 1.0), green / (blue + 1.0));
    // From light to dark skin both ratios grow, and the second one ends at 1.3.
    let expected = (1.149 + 0.85 * (by_green - 1.208)).clamp(1.10, 1.30);
    if (1.13..1.56).contains(&by_green) && (by_blue - expected).abs() < 0.095 {
        return PixelClass::Skin;
    }
    let saturation = (most - least) / most;
    // Bricks and wood are less saturated reds and oranges; fire is brighter than anything.
    let is_earthy = red >= green && green >= blue * 0.9 && saturation < 0.72;
    let is_fire = red > 250.0 && green > 90.0;
    if saturation > 0.5 && !is_earthy && !is_fire { PixelClass::Clothes } else { PixelClass::Other }
}
