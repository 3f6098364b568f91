//! Textures of materials: a repeating square meter.

use std::sync::{Arc, OnceLock};

use crate::render::noise::Noise;
use crate::render::texture::Texture;
use crate::scenery::Material;

/// Binary logarithm of the texels per meter.
const SHIFT: u32 = 8;

/// Returns the texture of a square meter of a material of that roughness.
/// A smooth one is painted once per process.
pub(crate) fn square_meter(of: Material, roughness: f64) -> Arc<Texture> {
    static SMOOTH: [OnceLock<Arc<Texture>>; 7] = [const { OnceLock::new() }; 7];
    match SMOOTH.get(of as usize).filter(|_| roughness == 0.0) {
        Some(painted) => painted.get_or_init(|| Arc::new(material(of, 0.0))).clone(),
        None => Arc::new(material(of, roughness)),
    }
}

/// Paints a square meter of a material; roughness from 0 to 1 adds bumps.
fn material(material: Material, roughness: f64) -> Texture {
    let roughness = roughness as f32;
    let bumps = Noise(0x0b55);
    Texture::paint([SHIFT, SHIFT], |u, v| {
        let [red, green, blue] = color(material, u, v);
        let mut light = 1.0;
        if roughness > 0.0 {
            // Slopes of fine and coarse bumps towards the light.
            let height = |u: f32, v: f32| {
                bumps.fractal(u, v, [24, 24], 3) + 0.35 * bumps.smooth(u * 96.0, v * 96.0, [96, 96])
            };
            let slope = height(u + 0.006, v + 0.006) - height(u, v);
            light = (1.0 + 2.4 * roughness * slope - 0.25 * roughness).clamp(0.1, 1.6);
        }
        [red * light, green * light, blue * light, 1.0]
    })
}

fn color(material: Material, u: f32, v: f32) -> [f32; 3] {
    match material {
        Material::Brick => brick(u, v),
        Material::Concrete => concrete(u, v),
        Material::Gravel => gravel(u, v),
        Material::Metal => metal(u, v),
        Material::Plaster => plaster(u, v),
        Material::Tiles => tiles(u, v),
        Material::Wood => wood(u, v),
    }
}

fn scaled([red, green, blue]: [f32; 3], light: f32) -> [f32; 3] {
    [red * light, green * light, blue * light]
}

fn mixed(a: [f32; 3], b: [f32; 3], share: f32) -> [f32; 3] {
    std::array::from_fn(|channel| a[channel] + (b[channel] - a[channel]) * share)
}

fn brick(u: f32, v: f32) -> [f32; 3] {
    const ROWS: f32 = 12.0;
    const COLUMNS: f32 = 4.0;
    let noise = Noise(0xb71c);
    let row = (v * ROWS).floor();
    let shift = if row as i32 % 2 == 0 { 0.0 } else { 0.5 };
    let along = u * COLUMNS + shift;
    let column = along.floor();
    let (x, y) = ((along - column) / COLUMNS, (v * ROWS - row) / ROWS);
    // Mortar of 1 cm.
    let edge = x.min_of(1.0 / COLUMNS - x).min_of(y.min_of(1.0 / ROWS - y));
    let grain = noise.fractal(u, v, [32, 32], 3);
    if edge < 0.005 {
        return scaled([0.62, 0.60, 0.57], 0.85 + 0.2 * grain);
    }
    let own = noise.cell((column as i32).rem_euclid(COLUMNS as i32), row as i32);
    let tone = mixed([0.50, 0.27, 0.22], [0.42, 0.20, 0.18], own);
    let rim = ((edge - 0.005) / 0.006).clamp(0.0, 1.0);
    scaled(tone, (0.78 + 0.22 * rim) * (0.75 + 0.45 * grain))
}

fn concrete(u: f32, v: f32) -> [f32; 3] {
    let noise = Noise(0xc0c0);
    let (spots, grain) = (noise.fractal(u, v, [3, 3], 5), noise.smooth(u * 128.0, v * 128.0, [128, 128]));
    scaled([0.56, 0.56, 0.55], 0.72 + 0.42 * spots + 0.12 * (grain - 0.5))
}

fn gravel(u: f32, v: f32) -> [f32; 3] {
    const CELLS: i32 = 28;
    let noise = Noise(0x6a7e);
    let other = Noise(0x1234);
    let (x, y) = (u * CELLS as f32, v * CELLS as f32);
    let (column, row) = (x.floor() as i32, y.floor() as i32);
    // The two nearest of the stones' middles (Worley, 1996, A cellular texture basis function).
    let (mut first, mut second, mut stone) = (9.0_f32, 9.0_f32, 0.0);
    for dy in -1..=1 {
        for dx in -1..=1 {
            let cell = ((column + dx).rem_euclid(CELLS), (row + dy).rem_euclid(CELLS));
            let middle_x = (column + dx) as f32 + noise.cell(cell.0, cell.1);
            let middle_y = (row + dy) as f32 + other.cell(cell.0, cell.1);
            let square = (middle_x - x) * (middle_x - x) + (middle_y - y) * (middle_y - y);
            if square < first {
                (second, first) = (first, square);
                stone = noise.cell(cell.1, cell.0 + 77);
            } else if square < second {
                second = square;
            }
        }
    }
    let gap = ((second.sqrt() - first.sqrt()) * 4.0).clamp(0.0, 1.0);
    let tone = mixed([0.42, 0.41, 0.40], [0.66, 0.63, 0.59], stone);
    scaled(tone, 0.35 + 0.65 * gap)
}

fn metal(u: f32, v: f32) -> [f32; 3] {
    let noise = Noise(0x3e7a);
    let brushed = noise.smooth(u * 6.0, v * 160.0, [6, 160]);
    let seam = if u % 0.5 < 0.008 { 0.6 } else { 1.0 };
    scaled([0.62, 0.65, 0.68], (0.88 + 0.14 * brushed) * seam)
}

fn plaster(u: f32, v: f32) -> [f32; 3] {
    let noise = Noise(0x9145);
    let (stains, grain) = (noise.fractal(u, v, [2, 2], 4), noise.fractal(u, v, [64, 64], 2));
    scaled([0.84, 0.83, 0.80], 0.80 + 0.18 * stains + 0.10 * grain)
}

fn tiles(u: f32, v: f32) -> [f32; 3] {
    const TILES: f32 = 4.0;
    let noise = Noise(0x711e);
    let (column, row) = ((u * TILES).floor(), (v * TILES).floor());
    let (x, y) = (u - column / TILES, v - row / TILES);
    let edge = x.min_of(1.0 / TILES - x).min_of(y.min_of(1.0 / TILES - y));
    let grain = noise.fractal(u, v, [8, 8], 4);
    if edge < 0.003 {
        return [0.30, 0.29, 0.28];
    }
    let own = noise.cell(column as i32, row as i32);
    let tone = mixed([0.64, 0.66, 0.67], [0.57, 0.59, 0.61], own);
    scaled(tone, 0.88 + 0.2 * grain)
}

fn wood(u: f32, v: f32) -> [f32; 3] {
    const BOARDS: f32 = 5.0;
    let noise = Noise(0x300d);
    let board = (u * BOARDS).floor();
    let x = u - board / BOARDS;
    let edge = x.min_of(1.0 / BOARDS - x);
    let own = noise.cell(board as i32, 3);
    let warp = noise.smooth(u * 10.0, v * 3.0, [10, 3]);
    let fibers = noise.smooth(u * 90.0 + 6.0 * warp, v * 4.0 + own * 4.0, [90, 4]);
    let tone = mixed([0.66, 0.56, 0.42], [0.56, 0.45, 0.32], own);
    let gap = if edge < 0.003 { 0.45 } else { 1.0 };
    scaled(tone, (0.78 + 0.3 * fibers) * gap)
}

/// Minimum of two numbers, equal in all builds.
trait MinimumOf {
    fn min_of(self, other: Self) -> Self;
}

impl MinimumOf for f32 {
    fn min_of(self, other: Self) -> Self {
        if other < self { other } else { self }
    }
}
