//! Scenery for cameras: surfaces, signs, victims, decoys and fires.

use serde::{Deserialize, Serialize};

use crate::error::DocumentStep;

/// Largest number of objects of a kind in a world.
const MAX_OBJECTS: usize = 256;
/// Largest coordinate or length, m.
const MAX_COORDINATE: f64 = 1e5;
/// Number of tags of the family 16h5.
const TAGS: u32 = 30;
/// Longest text of a QR code, bytes.
const LONGEST_TEXT: usize = 120;

/// Appearance of a world.
/// Robots do not touch it, and only cameras see it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scenery {
    /// Default height of bodies, m; 1.2 by default.
    pub wall_height: Option<f64>,
    /// Default material of bodies; plaster by default.
    pub wall: Option<Material>,
    /// Material of the floor outside of `floors`; concrete by default.
    pub floor: Option<Material>,
    /// Roughness of that floor, 0 to 1; 0.2 by default.
    pub floor_roughness: Option<f64>,
    /// Height of the ceiling, m; none by default.
    pub ceiling: Option<f64>,
    /// Share of ambient light, 0 to 1; 0.6 by default.
    pub ambience: Option<f64>,
    /// Different parts of the floor; later ones cover earlier ones.
    pub floors: Vec<FloorDescription>,
    /// Signs with codes.
    pub signs: Vec<SignDescription>,
    /// Victims.
    pub victims: Vec<VictimDescription>,
    /// Decoys: objects in the colors of victims.
    pub decoys: Vec<DecoyDescription>,
    /// Fires.
    pub fires: Vec<FireDescription>,
}

/// Material of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Material {
    /// Bricks with mortar.
    Brick,
    /// Plain concrete.
    Concrete,
    /// Stones of some centimeters.
    Gravel,
    /// Painted sheet.
    Metal,
    /// White plaster.
    Plaster,
    /// Square tiles of 25 cm.
    Tiles,
    /// Boards.
    Wood,
}

/// Rectangle of the floor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FloorDescription {
    /// Center, m.
    pub center: [f64; 2],
    /// Extent along x and along y, m.
    pub size: [f64; 2],
    /// Material.
    pub material: Material,
    /// Roughness, 0 to 1.
    #[serde(default)]
    pub roughness: f64,
}

/// Square one-sided sign with a code.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignDescription {
    /// Name.
    pub name: String,
    /// Center, m.
    /// The sign is rendered 5 mm in front of it, so that it may be on a wall.
    pub position: [f64; 3],
    /// Direction that it faces, rad.
    #[serde(default)]
    pub theta: f64,
    /// Side of the code without its white margin, m.
    pub size: f64,
    /// Text of a QR code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub qr: Option<String>,
    /// Number of a tag of the AprilTag family 16h5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub april_tag: Option<u32>,
}

/// Posture of a victim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Posture {
    /// Lying on the floor, seen from the side.
    Lying,
    /// Sitting on the floor, leaning on something.
    Sitting,
    /// Standing upright.
    Standing,
    /// Trapped in a hole of a wall.
    Trapped,
}

/// A victim.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VictimDescription {
    /// Name, which determines the colors of skin and clothes.
    pub name: String,
    /// Middle of the lower edge, m: x, y and z.
    pub position: [f64; 3],
    /// Direction that the hole of a trapped victim faces, rad.
    /// Other victims look the same from all sides.
    #[serde(default)]
    pub theta: f64,
    /// Posture.
    pub posture: Posture,
    /// Waving of an arm.
    #[serde(default)]
    pub waves: bool,
}

/// Shape of a decoy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DecoyShape {
    /// Ball in the color of skin.
    Ball,
    /// Cloth in the colors of clothes.
    Cloth,
    /// Board in the color of skin.
    Board,
}

/// Decoy: an object in the colors of victims.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DecoyDescription {
    /// Name, which determines its colors.
    pub name: String,
    /// Middle of the lower edge, m: x, y and z.
    pub position: [f64; 3],
    /// Shape.
    pub shape: DecoyShape,
    /// Width and height, m.
    pub size: [f64; 2],
}

/// Flickering fire.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FireDescription {
    /// Name.
    pub name: String,
    /// Middle of the lower edge, m: x, y and z.
    pub position: [f64; 3],
    /// Width and height, m.
    pub size: [f64; 2],
}

/// Invalid value: its path, and the expectation.
type InvalidSceneryValue<'a> = (Vec<DocumentStep<'a>>, String);

impl Scenery {
    /// Adds the objects of another scenery; its surfaces replace those of this one.
    pub fn add(&mut self, other: &Self) {
        self.wall_height = other.wall_height.or(self.wall_height);
        self.wall = other.wall.or(self.wall);
        self.floor = other.floor.or(self.floor);
        self.floor_roughness = other.floor_roughness.or(self.floor_roughness);
        self.ceiling = other.ceiling.or(self.ceiling);
        self.ambience = other.ambience.or(self.ambience);
        self.floors.extend_from_slice(&other.floors);
        self.signs.extend_from_slice(&other.signs);
        self.victims.extend_from_slice(&other.victims);
        self.decoys.extend_from_slice(&other.decoys);
        self.fires.extend_from_slice(&other.fires);
    }

    /// Returns the path of an invalid value, and the expectation.
    pub(crate) fn invalid_value(&self) -> Option<InvalidSceneryValue<'static>> {
        let heights = [("wall_height", self.wall_height), ("ceiling", self.ceiling)];
        for (key, height) in heights {
            if !height.is_none_or(|height| height > 0.0 && height <= 100.0) {
                return Some((vec![DocumentStep::Key(key)], "expected a height above 0, up to 100 m".into()));
            }
        }
        for (key, value) in [("floor_roughness", self.floor_roughness), ("ambience", self.ambience)] {
            if !value.is_none_or(|value| (0.0..=1.0).contains(&value)) {
                return Some((vec![DocumentStep::Key(key)], "expected a number from 0 to 1".into()));
            }
        }
        self.invalid_part().map(|(table, index, key, message)| {
            let item = [DocumentStep::Key(table), DocumentStep::Index(index)];
            let key = Some(key).filter(|key| !key.is_empty()).map(DocumentStep::Key);
            (item.into_iter().chain(key).collect(), message)
        })
    }

    /// Returns table, index and key of an object's invalid value, and the expectation.
    fn invalid_part(&self) -> Option<(&'static str, usize, &'static str, String)> {
        fn first<'a, T: 'a>(
            table: &'static str,
            things: &'a [T],
            invalid_value: impl Fn(&'a T) -> Option<(&'static str, String)>,
        ) -> Option<(&'static str, usize, &'static str, String)> {
            if things.len() > MAX_OBJECTS {
                return Some((table, MAX_OBJECTS, "", format!("expected at most {MAX_OBJECTS} of them")));
            }
            let mut all = things.iter().enumerate();
            all.find_map(|(index, thing)| {
                invalid_value(thing).map(|(key, message)| (table, index, key, message))
            })
        }
        first("floors", &self.floors, FloorDescription::invalid_value)
            .or_else(|| first("signs", &self.signs, SignDescription::invalid_value))
            .or_else(|| {
                first("victims", &self.victims, |victim| {
                    place(&victim.position).or_else(|| turn(victim.theta))
                })
            })
            .or_else(|| {
                first("decoys", &self.decoys, |decoy| place(&decoy.position).or_else(|| extent(decoy.size)))
            })
            .or_else(|| {
                first("fires", &self.fires, |fire| place(&fire.position).or_else(|| extent(fire.size)))
            })
    }
}

fn place(position: &[f64]) -> Option<(&'static str, String)> {
    let is_near = position.iter().all(|value| value.abs() <= MAX_COORDINATE);
    (!is_near).then(|| ("position", "expected coordinates in meters, up to 100000".into()))
}

fn turn(theta: f64) -> Option<(&'static str, String)> {
    (theta.is_nan() || theta.abs() > 1e3).then(|| ("theta", "expected an angle in radians".into()))
}

fn extent(size: [f64; 2]) -> Option<(&'static str, String)> {
    let is_extent = size.iter().all(|side| *side >= 0.01 && *side <= 20.0);
    (!is_extent).then(|| ("size", "expected a width and a height from 0.01 to 20 m".into()))
}

impl FloorDescription {
    fn invalid_value(&self) -> Option<(&'static str, String)> {
        let is_size = self.size.iter().all(|side| *side > 0.0 && *side <= MAX_COORDINATE);
        if !self.center.iter().all(|value| value.abs() <= MAX_COORDINATE) {
            return Some(("center", "expected coordinates in meters, up to 100000".into()));
        }
        if !is_size {
            return Some(("size", "expected two positive lengths in meters".into()));
        }
        let is_share = (0.0..=1.0).contains(&self.roughness);
        (!is_share).then(|| ("roughness", "expected a number from 0 to 1".into()))
    }
}

impl SignDescription {
    fn invalid_value(&self) -> Option<(&'static str, String)> {
        if !(self.size >= 0.01 && self.size <= 10.0) {
            return Some(("size", "expected a side from 0.01 to 10 m".into()));
        }
        match (&self.qr, self.april_tag) {
            (Some(text), None) if text.is_empty() || text.len() > LONGEST_TEXT => {
                Some(("qr", format!("expected a text of 1 to {LONGEST_TEXT} bytes")))
            }
            (None, Some(number)) if number >= TAGS => {
                Some(("april_tag", format!("expected a number of a tag of 16h5, from 0 to {}", TAGS - 1)))
            }
            (Some(_), Some(_)) | (None, None) => {
                Some(("", format!("sign `{}`: expected either `qr` or `april_tag`", self.name)))
            }
            _ => place(&self.position).or_else(|| turn(self.theta)),
        }
    }
}
