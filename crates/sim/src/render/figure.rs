//! Pictures of people and of decoys, composed of rounded bones.

use slate_module::math::{cos, sin};

use crate::render::noise::Noise;
use crate::render::texture::Texture;
use crate::scenery::{DecoyShape, Posture};

/// Number of phases of a waving arm.
pub(crate) const PHASES: u32 = 8;

/// Colors of hair, skin, and clothes of the upper and the lower body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outfit {
    hair: [f32; 3],
    skin: [f32; 3],
    top: [f32; 3],
    bottom: [f32; 3],
}

const SKINS: [[f32; 3]; 5] =
    [[0.93, 0.77, 0.67], [0.88, 0.69, 0.57], [0.79, 0.59, 0.46], [0.66, 0.47, 0.36], [0.52, 0.36, 0.28]];
const HAIRS: [[f32; 3]; 4] = [[0.12, 0.10, 0.09], [0.28, 0.19, 0.12], [0.60, 0.49, 0.30], [0.45, 0.44, 0.43]];
const CLOTHES: [[f32; 3]; 8] = [
    [0.14, 0.24, 0.58],
    [0.72, 0.14, 0.15],
    [0.13, 0.42, 0.24],
    [0.90, 0.75, 0.16],
    [0.88, 0.44, 0.10],
    [0.40, 0.20, 0.48],
    [0.10, 0.50, 0.58],
    [0.82, 0.28, 0.48],
];
const TROUSERS: [[f32; 3]; 4] =
    [[0.17, 0.20, 0.31], [0.20, 0.20, 0.21], [0.36, 0.32, 0.25], [0.10, 0.16, 0.42]];

impl Outfit {
    /// Returns the colors determined by a name.
    pub fn named(name: &str) -> Self {
        let hash = name
            .bytes()
            .fold(0x811c_9dc5_u32, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193));
        let noise = Noise(hash);
        let pick = |part: i32, count: usize| ((noise.cell(part, 0) * count as f32) as usize).min(count - 1);
        Self {
            hair: HAIRS[pick(1, HAIRS.len())],
            skin: SKINS[pick(2, SKINS.len())],
            top: CLOTHES[pick(3, CLOTHES.len())],
            bottom: TROUSERS[pick(4, TROUSERS.len())],
        }
    }
}

/// Rounded bone between two points, with a radius at each, m.
#[derive(Clone, Copy, Debug)]
struct Bone {
    from: [f32; 2],
    to: [f32; 2],
    radii: [f32; 2],
    color: [f32; 3],
}

impl Bone {
    fn new(from: [f32; 2], to: [f32; 2], radii: [f32; 2], color: [f32; 3]) -> Self {
        Self { from, to, radii, color }
    }

    fn disc(center: [f32; 2], radius: f32, color: [f32; 3]) -> Self {
        Self::new(center, center, [radius; 2], color)
    }

    /// Returns the distance from its outline, m, and the relative offset from its axis.
    /// The distance is negative inside; the offset is a share of the radius.
    fn distance(&self, [x, y]: [f32; 2]) -> (f32, f32) {
        let (along, to) = (difference(self.to, self.from), difference([x, y], self.from));
        let length = along[0] * along[0] + along[1] * along[1];
        let share = if length > 0.0 { (to[0] * along[0] + to[1] * along[1]) / length } else { 0.0 };
        let share = share.clamp(0.0, 1.0);
        let off = difference(to, [along[0] * share, along[1] * share]);
        let off = (off[0] * off[0] + off[1] * off[1]).sqrt();
        let radius = self.radii[0] + (self.radii[1] - self.radii[0]) * share;
        (off - radius, (off / radius).clamp(0.0, 1.0))
    }
}

fn difference(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// Returns width and height of a posture's picture, m.
pub(crate) fn extent(posture: Posture) -> [f64; 2] {
    match posture {
        Posture::Lying => [1.9, 0.75],
        Posture::Sitting => [1.0, 1.05],
        Posture::Standing => [1.1, 1.95],
        Posture::Trapped => [0.56, 0.5],
    }
}

/// Paints a person with an arm at a phase of its wave.
pub(crate) fn person(posture: Posture, outfit: Outfit, waves: bool, phase: u32) -> Texture {
    let angle = std::f64::consts::TAU * f64::from(phase) / f64::from(PHASES);
    // The forearm swings about upright.
    let swing = (1.4 + 0.7 * sin(angle)) as f32;
    let lift = [cos(f64::from(swing)) as f32, sin(f64::from(swing)) as f32];
    let lift = waves.then_some(lift);
    let bones = match posture {
        Posture::Lying => lying(outfit, lift),
        Posture::Sitting => sitting(outfit, lift),
        Posture::Standing => standing(outfit, lift),
        Posture::Trapped => trapped(outfit, lift),
    };
    let shifts = match posture {
        Posture::Lying => [8, 7],
        Posture::Standing => [7, 8],
        Posture::Sitting | Posture::Trapped => [7, 7],
    };
    let size = extent(posture).map(|side| side as f32);
    let texel = size[1] / (1_u32 << shifts[1]) as f32;
    Texture::paint(shifts, |u, v| {
        let point = [(u - 0.5) * size[0], v * size[1]];
        let ground = if posture == Posture::Trapped { hole(point, size, texel) } else { [0.0; 4] };
        bones.iter().fold(ground, |below, bone| painted(below, bone, point, texel))
    })
}

fn painted(below: [f32; 4], bone: &Bone, point: [f32; 2], texel: f32) -> [f32; 4] {
    let (distance, off) = bone.distance(point);
    let cover = (0.5 - distance / texel).clamp(0.0, 1.0);
    if cover <= 0.0 {
        return below;
    }
    let light = 0.70 + 0.30 * (1.0 - off * off).sqrt();
    let alpha = below[3] + (1.0 - below[3]) * cover;
    let share = cover / alpha;
    let mut mixed = [0.0, 0.0, 0.0, alpha];
    for channel in 0..3 {
        mixed[channel] = below[channel] + (bone.color[channel] * light - below[channel]) * share;
    }
    mixed
}

/// Returns color and opacity of a dark hole with a broken rim.
fn hole([x, y]: [f32; 2], [width, height]: [f32; 2], texel: f32) -> [f32; 4] {
    let noise = Noise(0x401e);
    let rough = 0.03 * noise.smooth((x + 1.0) * 14.0, (y + 1.0) * 14.0, [64, 64]);
    let (aside, above) = ((x / (width * 0.5)).abs(), (y / (height * 0.5) - 1.0).abs());
    let out = aside * aside * aside * aside + above * above * above * above;
    let distance = (out - 0.75) * 0.1 + rough;
    let cover = (0.5 - distance / texel).clamp(0.0, 1.0);
    let depth = 0.10 + 0.05 * (y / height);
    [depth, depth, depth * 0.95, cover]
}

fn head(center: [f32; 2], outfit: Outfit) -> Vec<Bone> {
    let Outfit { hair, skin, .. } = outfit;
    let [x, y] = center;
    let eye = |side: f32| Bone::disc([x + side * 0.038, y + 0.012], 0.013, [0.12, 0.09, 0.08]);
    vec![
        Bone::new([x - 0.02, y + 0.04], [x + 0.02, y + 0.04], [0.112; 2], hair),
        Bone::new([x, y - 0.025], [x, y + 0.02], [0.085, 0.098], skin),
        eye(-1.0),
        eye(1.0),
        Bone::new([x - 0.025, y - 0.055], [x + 0.025, y - 0.055], [0.007; 2], [0.55, 0.25, 0.24]),
    ]
}

/// Returns upper arm, forearm and hand.
/// `lift` is the direction of a lifted forearm.
fn arm(
    shoulder: [f32; 2],
    side: f32,
    lift: Option<[f32; 2]>,
    hanging: [f32; 2],
    outfit: Outfit,
) -> [Bone; 3] {
    let [x, y] = shoulder;
    let elbow = match lift {
        Some(_) => [x + side * 0.20, y + 0.04],
        None => [x + (hanging[0] - x) * 0.5 + side * 0.02, (y + hanging[1]) * 0.5],
    };
    let hand = match lift {
        Some([along, up]) => [elbow[0] + side * 0.27 * along, elbow[1] + 0.27 * up],
        None => hanging,
    };
    [
        Bone::new(shoulder, elbow, [0.062, 0.052], outfit.top),
        Bone::new(elbow, hand, [0.048, 0.038], outfit.skin),
        Bone::disc(hand, 0.055, outfit.skin),
    ]
}

fn standing(outfit: Outfit, lift: Option<[f32; 2]>) -> Vec<Bone> {
    let shoe = [0.10, 0.10, 0.11];
    let mut bones = Vec::new();
    for side in [-1.0_f32, 1.0] {
        bones.push(Bone::new([side * 0.10, 0.05], [side * 0.15, 0.045], [0.05, 0.045], shoe));
        bones.push(Bone::new([side * 0.10, 0.10], [side * 0.09, 0.86], [0.062, 0.092], outfit.bottom));
    }
    bones.extend(arm([-0.21, 1.38], -1.0, None, [-0.27, 0.85], outfit));
    bones.push(Bone::new([0.0, 1.44], [0.0, 1.52], [0.055; 2], outfit.skin));
    bones.push(Bone::new([0.0, 0.94], [0.0, 1.30], [0.155, 0.185], outfit.top));
    bones.push(Bone::new([-0.15, 1.39], [0.15, 1.39], [0.075; 2], outfit.top));
    bones.extend(arm([0.21, 1.38], 1.0, lift, [0.27, 0.85], outfit));
    bones.extend(head([0.0, 1.62], outfit));
    bones
}

fn sitting(outfit: Outfit, lift: Option<[f32; 2]>) -> Vec<Bone> {
    let mut bones = Vec::new();
    bones.push(Bone::new([0.0, 0.60], [0.0, 0.70], [0.055; 2], outfit.skin));
    bones.push(Bone::new([0.0, 0.20], [0.0, 0.48], [0.165, 0.185], outfit.top));
    bones.push(Bone::new([-0.15, 0.56], [0.15, 0.56], [0.075; 2], outfit.top));
    for side in [-1.0_f32, 1.0] {
        bones.push(Bone::new([side * 0.11, 0.14], [side * 0.27, 0.36], [0.095, 0.075], outfit.bottom));
        bones.push(Bone::new([side * 0.27, 0.36], [side * 0.31, 0.08], [0.072, 0.055], outfit.bottom));
        bones.push(Bone::new([side * 0.31, 0.045], [side * 0.36, 0.04], [0.045, 0.04], [0.10, 0.10, 0.11]));
    }
    bones.extend(arm([-0.21, 0.55], -1.0, None, [-0.30, 0.20], outfit));
    bones.extend(arm([0.21, 0.55], 1.0, lift, [0.30, 0.20], outfit));
    bones.extend(head([0.0, 0.79], outfit));
    bones
}

fn lying(outfit: Outfit, lift: Option<[f32; 2]>) -> Vec<Bone> {
    let shoe = [0.10, 0.10, 0.11];
    let mut bones = vec![
        Bone::new([-0.86, 0.06], [-0.86, 0.15], [0.05, 0.045], shoe),
        Bone::new([-0.80, 0.075], [-0.05, 0.11], [0.06, 0.09], outfit.bottom),
        Bone::new([-0.78, 0.085], [-0.45, 0.24], [0.055, 0.072], outfit.bottom),
        Bone::new([-0.45, 0.24], [-0.03, 0.13], [0.072, 0.092], outfit.bottom),
        Bone::new([0.02, 0.135], [0.42, 0.16], [0.125, 0.155], outfit.top),
        Bone::new([0.50, 0.14], [0.60, 0.14], [0.055; 2], outfit.skin),
    ];
    let hand = match lift {
        Some([along, up]) => [0.34 + 0.25 * along, 0.36 + 0.27 * up],
        None => [0.05, 0.15],
    };
    let elbow = if lift.is_some() { [0.34, 0.36] } else { [0.22, 0.23] };
    bones.push(Bone::new([0.40, 0.20], elbow, [0.06, 0.052], outfit.top));
    bones.push(Bone::new(elbow, hand, [0.048, 0.038], outfit.skin));
    bones.push(Bone::disc(hand, 0.055, outfit.skin));
    bones.push(Bone::new([0.74, 0.13], [0.76, 0.16], [0.112; 2], outfit.hair));
    bones.push(Bone::new([0.69, 0.135], [0.73, 0.14], [0.088, 0.097], outfit.skin));
    bones.push(Bone::disc([0.70, 0.175], 0.012, [0.12, 0.09, 0.08]));
    bones.push(Bone::new([0.645, 0.13], [0.645, 0.155], [0.007; 2], [0.55, 0.25, 0.24]));
    bones
}

fn trapped(outfit: Outfit, lift: Option<[f32; 2]>) -> Vec<Bone> {
    let mut bones = vec![
        Bone::new([0.0, 0.13], [0.0, 0.20], [0.055; 2], outfit.skin),
        Bone::new([-0.13, 0.075], [0.13, 0.075], [0.075; 2], outfit.top),
    ];
    bones.extend(head([0.0, 0.28], outfit));
    let [along, up] = lift.unwrap_or([0.2, 0.1]);
    let hand = [0.15 + 0.06 * along, 0.12 + 0.17 * up];
    bones.push(Bone::new([0.15, 0.07], hand, [0.045, 0.036], outfit.skin));
    bones.push(Bone::disc(hand, 0.048, outfit.skin));
    bones
}

/// Paints a decoy in the colors of people.
pub(crate) fn decoy(shape: DecoyShape, outfit: Outfit) -> Texture {
    let noise = Noise(0xdec0);
    Texture::paint([7, 7], |u, v| {
        let ([red, green, blue], light, cover) = match shape {
            DecoyShape::Ball => {
                let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
                let square = x * x + y * y;
                let toward = (1.0 - square.clamp(0.0, 1.0)).sqrt();
                let light = 0.55 + 0.45 * (0.8 * toward + 0.4 * y).clamp(0.0, 1.0);
                (outfit.skin, light, ((1.0 - square.sqrt()) * 64.0 + 0.5).clamp(0.0, 1.0))
            }
            DecoyShape::Cloth => {
                let folds = noise.smooth(u * 9.0, v * 2.0, [9, 2]);
                let hem = 0.04 + 0.05 * noise.smooth(u * 7.0, 0.5, [8, 8]);
                let inside = if v < hem || !(0.03..=0.97).contains(&u) { 0.0 } else { 1.0 };
                (outfit.top, 0.62 + 0.5 * folds, inside)
            }
            DecoyShape::Board => (outfit.skin, 0.92 + 0.08 * noise.fractal(u, v, [4, 40], 3), 1.0),
        };
        [red * light, green * light, blue * light, cover]
    })
}

/// Paints a fire at a phase of its flicker.
pub(crate) fn flame(phase: u32) -> Texture {
    let noise = Noise(0xf1a3);
    let rise = phase as f32 / PHASES as f32;
    Texture::paint([6, 6], |u, v| {
        let turbulence = noise.fractal(u, v * 0.5 + 1.0 - rise, [6, 6], 3);
        let sway = (turbulence - 0.5) * 0.5 * v;
        let aside = ((u + sway - 0.5) * 2.0).abs();
        let width = (1.0 - v) * (0.55 + 0.9 * v) + 0.05;
        let heat = (1.0 - aside / width) * 1.4 - v * 0.7 + (turbulence - 0.45) * 1.6 * (0.4 + v);
        let edge = ((1.0 - aside / width) * 6.0).clamp(0.0, 1.0) * ((1.0 - v) * 8.0).clamp(0.0, 1.0);
        let alpha = (heat * 2.2).clamp(0.0, 1.0) * edge;
        let (hot, white) = (heat.clamp(0.0, 1.0), (heat - 0.75).clamp(0.0, 1.0));
        [1.0, 0.28 + 0.62 * hot, 0.04 + 1.6 * white * white + 0.1 * hot, alpha]
    })
}
