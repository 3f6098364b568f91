//! Periodic value noise for textures.

/// Pseudo-random numbers by position, from a seed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise(pub u32);

impl Noise {
    /// Returns the number of a cell, 0 to 1.
    pub fn cell(self, x: i32, y: i32) -> f32 {
        let mut hash = self.0 ^ (x as u32).wrapping_mul(0x9e37_79b9) ^ (y as u32).wrapping_mul(0x85eb_ca6b);
        hash ^= hash >> 16;
        hash = hash.wrapping_mul(0x7feb_352d);
        hash ^= hash >> 15;
        hash = hash.wrapping_mul(0x846c_a68b);
        hash ^= hash >> 16;
        (hash >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Returns smooth noise from 0 to 1 with a period of `width` and `height` cells.
    pub fn smooth(self, x: f32, y: f32, [width, height]: [i32; 2]) -> f32 {
        let (left, low) = (x.floor(), y.floor());
        let ease = |share: f32| share * share * (3.0 - 2.0 * share);
        let (right, up) = (ease(x - left), ease(y - low));
        let corner = |dx: i32, dy: i32| {
            self.cell((left as i32 + dx).rem_euclid(width), (low as i32 + dy).rem_euclid(height))
        };
        let mix = |a: f32, b: f32, share: f32| a + (b - a) * share;
        mix(mix(corner(0, 0), corner(1, 0), right), mix(corner(0, 1), corner(1, 1), right), up)
    }

    /// Returns a sum of octaves of smooth noise, 0 to 1.
    /// Frequencies double and amplitudes halve; the first octave has `cells` from 0 to 1.
    pub fn fractal(self, u: f32, v: f32, cells: [i32; 2], octaves: u32) -> f32 {
        let (mut sum, mut most, mut strength) = (0.0, 0.0, 1.0);
        for octave in 0..octaves {
            let [width, height] = cells.map(|count| count << octave);
            let own = Self(self.0.wrapping_add(octave.wrapping_mul(0x51ed_270b)));
            sum += strength * own.smooth(u * width as f32, v * height as f32, [width, height]);
            most += strength;
            strength *= 0.5;
        }
        sum / most
    }
}
