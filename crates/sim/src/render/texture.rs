//! Textures with mipmaps: halved sizes of the image prevent aliasing at distance.

/// Color, or radiance, of red, green and blue.
pub(crate) type Color = [f32; 3];

/// An image whose sides are powers of two. It repeats beyond its edges.
///
/// Texels are roots of linear values, which spends bits where eyes see steps.
#[derive(Clone, Debug)]
pub(crate) struct Texture {
    levels: Vec<MipLevel>,
}

#[derive(Clone, Debug)]
struct MipLevel {
    /// Binary logarithms of width and height.
    shifts: [u32; 2],
    /// The longer side, texels.
    longest: f32,
    texels: Vec<[u8; 4]>,
}

impl Texture {
    /// Creates a texture of 2 to the power of `shifts` columns and rows.
    /// `color` maps the middle of each texel, 0 to 1, the first row at the bottom. Colors are roots of linear ones;
    /// the last number is the opacity.
    pub fn paint(shifts: [u32; 2], mut color: impl FnMut(f32, f32) -> [f32; 4]) -> Self {
        let [width, height] = shifts.map(|shift| 1_u32 << shift);
        let at = |index: u32, count: u32| (index as f32 + 0.5) / count as f32;
        let texel = |row: u32, column: u32| (at(column, width), at(row, height));
        let places = (0..height).flat_map(|row| (0..width).map(move |column| texel(row, column)));
        let texels = places.map(|(u, v)| color(u, v).map(byte)).collect();
        let mut levels = vec![MipLevel::new(shifts, texels)];
        while let Some(half) = levels.last().and_then(MipLevel::half) {
            levels.push(half);
        }
        Self { levels }
    }

    /// Returns linear color and opacity at a place.
    /// `cover` is the share of the texture that a pixel covers: the greater of both directions, 0 to 1.
    #[inline]
    pub fn sample(&self, u: f32, v: f32, cover: f32) -> ([f32; 3], f32) {
        let Some(first) = self.levels.first() else { return ([0.0; 3], 0.0) };
        let texels = cover * first.longest;
        // The exponent of a number is the whole part of its binary logarithm; 1.41 rounds.
        let exponent = (((texels * std::f32::consts::SQRT_2).to_bits() >> 23) & 0xff).saturating_sub(127);
        let level = &self.levels[(exponent as usize).min(self.levels.len() - 1)];
        level.sample(u, v)
    }
}

fn byte(value: f32) -> u8 {
    // A float beyond the range of an integer becomes its nearest one.
    (value * 255.0 + 0.5) as u8
}

impl MipLevel {
    fn new(shifts: [u32; 2], texels: Vec<[u8; 4]>) -> Self {
        Self { shifts, longest: (1_u32 << shifts[0].max(shifts[1])) as f32, texels }
    }

    /// Returns the mean of each four texels; none of a single one.
    fn half(&self) -> Option<Self> {
        let [wide, high] = self.shifts;
        if wide == 0 && high == 0 {
            return None;
        }
        let shifts = [wide.saturating_sub(1), high.saturating_sub(1)];
        let (right, up) = (usize::from(wide > 0), usize::from(high > 0) << wide);
        let mut texels = Vec::with_capacity(1 << (shifts[0] + shifts[1]));
        for row in 0..1_usize << shifts[1] {
            for column in 0..1_usize << shifts[0] {
                let first = (row << usize::from(high > 0) << wide) + (column << right);
                let four = [first, first + right, first + up, first + right + up].map(|at| self.texels[at]);
                let alpha: u32 = four.iter().map(|texel| u32::from(texel[3])).sum();
                let mut mean = [0; 4];
                for (channel, mean) in mean.iter_mut().enumerate().take(3) {
                    // Transparent pixels have no color to mix.
                    let sum: u32 =
                        four.iter().map(|texel| u32::from(texel[channel]) * u32::from(texel[3])).sum();
                    *mean = (sum + alpha / 2).checked_div(alpha).unwrap_or(0) as u8;
                }
                mean[3] = ((alpha + 2) / 4) as u8;
                texels.push(mean);
            }
        }
        Some(Self::new(shifts, texels))
    }

    /// Bilinear interpolation of the linear color's roots.
    #[inline]
    fn sample(&self, u: f32, v: f32) -> ([f32; 3], f32) {
        let [wide, high] = self.shifts;
        let (column, right) = place(u, wide);
        let (row, up) = place(v, high);
        let (next_column, next_row) = ((column + 1) & ((1 << wide) - 1), (row + 1) & ((1 << high) - 1));
        let texel = |row: usize, column: usize| self.texels[(row << wide) | column];
        let (low, low_right) = (texel(row, column), texel(row, next_column));
        let (top, top_right) = (texel(next_row, column), texel(next_row, next_column));
        let weights = [
            (1.0 - right) * (1.0 - up) * (1.0 / 255.0),
            right * (1.0 - up) * (1.0 / 255.0),
            (1.0 - right) * up * (1.0 / 255.0),
            right * up * (1.0 / 255.0),
        ];
        // Written out, as a loop over channels is not always compiled into its steps.
        let channel = |a: u8, b: u8, c: u8, d: u8| {
            f32::from(a) * weights[0]
                + f32::from(b) * weights[1]
                + f32::from(c) * weights[2]
                + f32::from(d) * weights[3]
        };
        let red = channel(low[0], low_right[0], top[0], top_right[0]);
        let green = channel(low[1], low_right[1], top[1], top_right[1]);
        let blue = channel(low[2], low_right[2], top[2], top_right[2]);
        let alpha = channel(low[3], low_right[3], top[3], top_right[3]);
        ([red * red, green * green, blue * blue], alpha)
    }
}

/// Texel below a coordinate, and the share of the next one.
#[inline]
fn place(coordinate: f32, shift: u32) -> (usize, f32) {
    let scaled = coordinate * (1_u32 << shift) as f32 - 0.5;
    let whole = scaled as i32;
    let whole = if (whole as f32) > scaled { whole.wrapping_sub(1) } else { whole };
    let share = scaled - whole as f32;
    ((whole & ((1 << shift) - 1)) as usize, share)
}
