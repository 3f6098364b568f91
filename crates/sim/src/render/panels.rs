//! Upright pictures in a world: signs on walls, and billboards facing the camera.

use std::sync::Arc;

use slate_module::math::{cos, sin};

use crate::render::code::CellPattern;
use crate::render::figure::{self, Outfit, PHASES};
use crate::render::raster::{Finish, Plane};
use crate::render::texture::{Color, Texture};
use crate::scenery::{
    DecoyDescription, FireDescription, Posture, Scenery, SignDescription, VictimDescription,
};
use crate::viewpoint::{CameraPose, Vector, dot, plus};

/// Distance of a sign in front of its position, m.
const IN_FRONT: f64 = 0.005;
/// Period of a waving arm, and period of a fire's flicker, s.
const WAVE: f64 = 1.2;
const FLICKER: f64 = 0.8;
/// Radiance of a fire, relative to a white surface in full light.
const GLOW: f32 = 1.6;

/// Upright rectangle with a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Panel {
    /// Middle of the lower edge.
    pub position: Vector,
    size: [f64; 2],
    /// Direction that it faces; the camera's for `None`.
    facing: Option<[f64; 2]>,
    /// Number of its first picture, of 1 or [`PHASES`].
    pub texture: u16,
    phases: u32,
    /// Period of its sequence of pictures, s.
    period: f64,
    /// Presence of gaps through which other things are seen.
    pub has_gaps: bool,
    glows: bool,
}

impl Panel {
    /// Returns a standing person at a position, with a picture.
    pub fn person(position: Vector, texture: u16) -> Self {
        let size = figure::extent(Posture::Standing);
        Self { position, size, facing: None, texture, phases: 1, period: WAVE, has_gaps: true, glows: false }
    }

    /// Returns corners, plane and finish for a camera; `None` for its back.
    /// `now` is in seconds.
    pub fn view(&self, pose: &CameraPose, now: f64, light: Color) -> Option<([Vector; 4], Plane, Finish)> {
        let right = match self.facing {
            None => pose.axes[0],
            Some([x, y]) => {
                let toward = plus(pose.origin, self.position, -1.0);
                if dot(toward, [x, y, 0.0]) <= 0.0 {
                    return None;
                }
                [-y, x, 0.0]
            }
        };
        let [width, height] = self.size;
        let up = [0.0, 0.0, 1.0];
        let left = plus(self.position, right, -width / 2.0);
        let end = plus(left, right, width);
        let corners = [left, end, plus(end, up, height), plus(left, up, height)];
        let (u, v) = (right.map(|part| part / width), [0.0, 0.0, 1.0 / height]);
        let share = now / self.period;
        let phase = ((share - share.floor()) * f64::from(self.phases)) as u32;
        let texture = self.texture + phase.min(self.phases - 1) as u16;
        let tint = if self.glows { [GLOW; 3] } else { light };
        let finish = Finish { texture, tint, has_foot: false, glows: self.glows };
        Some((corners, Plane { origin: left, u, v, start: [0.0; 2] }, finish))
    }
}

/// Returns the panels of a scenery; appends their pictures to `textures`.
pub(crate) fn panels(scenery: &Scenery, textures: &mut Vec<Arc<Texture>>) -> Vec<Panel> {
    let mut panels = Vec::new();
    panels.extend(scenery.signs.iter().filter_map(|it| sign(it, textures)));
    panels.extend(scenery.victims.iter().map(|it| victim(it, textures)));
    panels.extend(scenery.decoys.iter().map(|it| decoy(it, textures)));
    if !scenery.fires.is_empty() {
        let first = textures.len() as u16;
        textures.extend((0..PHASES).map(|phase| Arc::new(figure::flame(phase))));
        panels.extend(scenery.fires.iter().map(|it| fire(it, first)));
    }
    panels
}

fn sign(sign: &SignDescription, textures: &mut Vec<Arc<Texture>>) -> Option<Panel> {
    let pattern = CellPattern::of(sign)?;
    let texture = textures.len() as u16;
    textures.push(Arc::new(pattern.paint()));
    let side = sign.size * pattern.scale();
    let facing = [cos(sign.theta), sin(sign.theta)];
    let [x, y, z] = sign.position;
    let position = [x + IN_FRONT * facing[0], y + IN_FRONT * facing[1], z - side / 2.0];
    let size = [side; 2];
    let facing = Some(facing);
    Some(Panel { position, size, facing, texture, phases: 1, period: 1.0, has_gaps: false, glows: false })
}

fn victim(victim: &VictimDescription, textures: &mut Vec<Arc<Texture>>) -> Panel {
    let VictimDescription { name, position, theta, posture, waves } = victim;
    let texture = textures.len() as u16;
    let phases = if *waves { PHASES } else { 1 };
    let outfit = Outfit::named(name);
    textures.extend((0..phases).map(|phase| Arc::new(figure::person(*posture, outfit, *waves, phase))));
    let mut position = *position;
    let facing = (*posture == Posture::Trapped).then(|| [cos(*theta), sin(*theta)]);
    if let Some([x, y]) = facing {
        position = plus(position, [x, y, 0.0], IN_FRONT);
    }
    let size = figure::extent(*posture);
    Panel { position, size, facing, texture, phases, period: WAVE, has_gaps: true, glows: false }
}

fn decoy(decoy: &DecoyDescription, textures: &mut Vec<Arc<Texture>>) -> Panel {
    let texture = textures.len() as u16;
    textures.push(Arc::new(figure::decoy(decoy.shape, Outfit::named(&decoy.name))));
    let DecoyDescription { position, size, .. } = *decoy;
    Panel { position, size, facing: None, texture, phases: 1, period: 1.0, has_gaps: true, glows: false }
}

fn fire(fire: &FireDescription, texture: u16) -> Panel {
    let FireDescription { position, size, .. } = *fire;
    Panel {
        position,
        size,
        facing: None,
        texture,
        phases: PHASES,
        period: FLICKER,
        has_gaps: true,
        glows: true,
    }
}
