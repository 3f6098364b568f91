//! Renderer of a world for cameras.

use std::sync::Arc;

use slate_module::math::max;
use slate_sorted::SortedMap;

use crate::geometry::Point;
use crate::render::figure::{self, Outfit};
use crate::render::materials::square_meter;
use crate::render::panels::{Panel, panels};
use crate::render::raster::{FAR_CLIP, Finish, Plane, Raster};
use crate::render::texture::{Color, Texture};
use crate::scenery::{Material, Posture, Scenery};
use crate::surroundings::{Mover, Surroundings};
use crate::viewpoint::{CameraPose, Vector};
use crate::world::World;

/// Default height of bodies, m, roughness of the floor and share of ambient light.
const WALL_HEIGHT: f64 = 1.2;
const ROUGHNESS: f64 = 0.2;
const AMBIENCE: f64 = 0.6;
/// Height of robots, m.
const ROBOT_HEIGHT: f64 = 0.35;
/// Number of different outfits.
const OUTFITS: usize = 6;
/// Direction towards the light, of length 1.
const LIGHT: Vector = [0.45, 0.30, 0.841];
/// Height of parts of the floor above the rest, which makes them nearer, m.
const PATCH: f64 = 0.001;
/// Colors of robots.
const ROBOTS: [Color; 4] = [[0.55, 0.12, 0.10], [0.12, 0.22, 0.50], [0.15, 0.35, 0.16], [0.45, 0.38, 0.10]];

/// Surfaces, signs and figures of a world with their textures.
#[derive(Clone, Debug)]
pub struct RenderedWorld {
    scenery: Scenery,
    wall_height: f64,
    ambience: f64,
    textures: Vec<Arc<Texture>>,
    materials: SortedMap<Material, u16>,
    /// Height and texture of each static body.
    bodies: Vec<(f64, u16)>,
    /// Textures of the floor and of its parts.
    floors: Vec<u16>,
    panels: Vec<Panel>,
    /// Pictures of walking people.
    people: Vec<u16>,
}

/// Scratch memory of a camera for the visible objects.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visible {
    /// Numbers of bodies, with their distances.
    bodies: Vec<(f64, usize)>,
    corners: Vec<Vector>,
    /// Panels with gaps, with their depths.
    panels: Vec<(f64, Panel)>,
}

impl RenderedWorld {
    /// Creates the textures of a world; `has_people` is true if people walk in it.
    pub fn new(world: &World, has_people: bool) -> Self {
        let scenery = world.scenery.clone();
        let mut textures = Vec::new();
        let mut materials = SortedMap::new();
        let mut add = |own: Material, textures: &mut Vec<Arc<Texture>>| {
            *materials.entry(own).or_insert_with(|| {
                textures.push(square_meter(own, 0.0));
                (textures.len() - 1) as u16
            })
        };
        let wall = add(scenery.wall.unwrap_or(Material::Plaster), &mut textures);
        let wall_height = scenery.wall_height.unwrap_or(WALL_HEIGHT);
        let bodies = world.bodies.iter().map(|body| {
            let texture = body.material.map_or(wall, |own| add(own, &mut textures));
            (body.height.unwrap_or(wall_height), texture)
        });
        let bodies = bodies.collect();
        add(Material::Metal, &mut textures);
        add(Material::Wood, &mut textures);
        let floor = scenery.floor.unwrap_or(Material::Concrete);
        let floor = std::iter::once((floor, scenery.floor_roughness.unwrap_or(ROUGHNESS)));
        let patches = scenery.floors.iter().map(|patch| (patch.material, patch.roughness));
        let floors = floor.chain(patches).map(|(own, roughness)| {
            textures.push(square_meter(own, roughness));
            (textures.len() - 1) as u16
        });
        let floors = floors.collect();
        let people = (0..if has_people { OUTFITS } else { 0 }).map(|number| {
            let outfit = Outfit::named(&format!("person {number}"));
            textures.push(Arc::new(figure::person(Posture::Standing, outfit, false, 0)));
            (textures.len() - 1) as u16
        });
        let people = people.collect();
        let panels = panels(&scenery, &mut textures);
        let ambience = scenery.ambience.unwrap_or(AMBIENCE);
        Self { scenery, wall_height, ambience, textures, materials, bodies, floors, panels, people }
    }

    /// Draws the view of robot number `own` at a time, s.
    pub(crate) fn draw(
        &self,
        own: usize,
        surroundings: &Surroundings,
        pose: &CameraPose,
        now: f64,
        visible: &mut Visible,
        raster: &mut Raster,
    ) {
        raster.begin();
        self.draw_bodies(own, surroundings, pose, visible, raster);
        visible.panels.clear();
        for panel in &self.panels {
            if panel.has_gaps {
                visible.panels.push((depth(pose, panel), *panel));
            } else if let Some((corners, plane, finish)) = panel.view(pose, now, self.light_of_panel()) {
                raster.draw(pose, &corners, &plane, finish);
            }
        }
        self.draw_ground(pose, raster);
        raster.shade(pose, &self.textures);
        self.add_people(surroundings, pose, visible);
        // Bodies behind are visible through gaps of bodies in front.
        visible
            .panels
            .sort_unstable_by(|(a, one), (b, other)| b.total_cmp(a).then(one.texture.cmp(&other.texture)));
        for (_, panel) in &visible.panels {
            if let Some((corners, plane, finish)) = panel.view(pose, now, self.light_of_panel()) {
                raster.overlay(pose, &corners, &plane, finish, &self.textures);
            }
        }
    }

    /// Draws static bodies, robots and doors.
    fn draw_bodies(
        &self,
        own: usize,
        surroundings: &Surroundings,
        pose: &CameraPose,
        visible: &mut Visible,
        raster: &mut Raster,
    ) {
        let eye = Point::new(pose.origin[0], pose.origin[1]);
        visible.bodies.clear();
        surroundings.near(eye, FAR_CLIP, |number, distance| visible.bodies.push((distance, number)));
        // The nearest hide most.
        visible.bodies.sort_unstable_by(|(a, one), (b, other)| a.total_cmp(b).then(one.cmp(other)));
        let statics = surroundings.bodies().len();
        for (_, number) in &visible.bodies {
            let (height, texture, tint) = match number.checked_sub(statics) {
                None => {
                    let (height, texture) = self.bodies[*number];
                    (height, texture, [1.0; 3])
                }
                Some(mover) if mover == own => continue,
                Some(mover) => match surroundings.mover(mover) {
                    Mover::Robot => {
                        (ROBOT_HEIGHT, self.materials[&Material::Metal], ROBOTS[mover % ROBOTS.len()])
                    }
                    Mover::Door => (self.wall_height, self.materials[&Material::Wood], [1.0; 3]),
                    Mover::Person => continue,
                },
            };
            let outline = surroundings.outline(*number);
            for (a, b) in outline.edges() {
                let along = b.minus(a);
                // Its back is turned to the camera.
                if along.cross(a.minus(eye)) > 0.0 {
                    self.draw_wall(pose, [a, b], height, (texture, tint), raster);
                }
            }
            if pose.origin[2] > height {
                visible.corners.clear();
                visible.corners.extend(outline.points.iter().map(|corner| [corner.x, corner.y, height]));
                let plane = level(height);
                let tint = self.tint(tint, [0.0, 0.0, 1.0]);
                let finish = Finish { texture, tint, has_foot: false, glows: false };
                raster.draw(pose, &visible.corners, &plane, finish);
            }
        }
    }

    fn draw_wall(
        &self,
        pose: &CameraPose,
        [a, b]: [Point; 2],
        height: f64,
        (texture, tint): (u16, Color),
        raster: &mut Raster,
    ) {
        let along = b.minus(a);
        let length = along.norm();
        let (x, y) = (along.x / length, along.y / length);
        let corners = [[a.x, a.y, 0.0], [b.x, b.y, 0.0], [b.x, b.y, height], [a.x, a.y, height]];
        // The pattern continues from wall to wall of a line.
        let plane =
            Plane { origin: corners[0], u: [x, y, 0.0], v: [0.0, 0.0, 1.0], start: [a.x * x + a.y * y, 0.0] };
        let tint = self.tint(tint, [y, -x, 0.0]);
        raster.draw(pose, &corners, &plane, Finish { texture, tint, has_foot: true, glows: false });
    }

    fn draw_ground(&self, pose: &CameraPose, raster: &mut Raster) {
        let up = [0.0, 0.0, 1.0];
        let finish = |texture, tint| Finish { texture, tint, has_foot: false, glows: false };
        for (patch, texture) in self.scenery.floors.iter().zip(&self.floors[1..]) {
            let ([x, y], [width, depth]) = (patch.center, patch.size);
            let corner = |right: f64, far: f64| [x + right * width / 2.0, y + far * depth / 2.0, PATCH];
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            raster.draw(pose, &corners, &level(PATCH), finish(*texture, self.tint([1.0; 3], up)));
        }
        raster.draw_plane(pose, &level(0.0), finish(self.floors[0], self.tint([1.0; 3], up)));
        if let Some(height) = self.scenery.ceiling.filter(|height| *height > pose.origin[2]) {
            let tint = self.tint([1.0; 3], [0.0, 0.0, -0.2]);
            raster.draw_plane(
                pose,
                &level(height),
                finish(self.bodies.first().map_or(0, |(_, own)| *own), tint),
            );
        }
    }

    fn add_people(&self, surroundings: &Surroundings, pose: &CameraPose, visible: &mut Visible) {
        let movers = surroundings.hulls().iter().enumerate().skip(surroundings.robot_count());
        for (number, hull) in movers.filter(|(number, _)| surroundings.mover(*number) == Mover::Person) {
            let Some(texture) = self.people.get(number % OUTFITS) else { continue };
            let Point { x, y } = hull.frame().origin;
            let panel = Panel::person([x, y, 0.0], *texture);
            visible.panels.push((depth(pose, &panel), panel));
        }
    }

    /// Light on a surface with that normal, on a color.
    fn tint(&self, color: Color, normal: Vector) -> Color {
        let toward = 0.5 + 0.5 * crate::viewpoint::dot(normal, LIGHT);
        let ambience = self.ambience;
        let light = (ambience + (1.0 - ambience) * 1.15 * toward) as f32;
        color.map(|part| part * light)
    }

    /// Light on upright figures, whose fronts are seen.
    fn light_of_panel(&self) -> Color {
        [max(0.9 * self.ambience, 0.45) as f32 + 0.3; 3]
    }
}

fn level(height: f64) -> Plane {
    Plane { origin: [0.0, 0.0, height], u: [1.0, 0.0, 0.0], v: [0.0, 1.0, 0.0], start: [0.0; 2] }
}

fn depth(pose: &CameraPose, panel: &Panel) -> f64 {
    pose.local(panel.position)[2]
}
