use std::sync::Arc;

use serde::{Deserialize, Serialize};
use slate_module::Random;

use crate::camera::head::PanTiltHead;
use crate::contact::Motion;
use crate::fault::{Display, Measurement};
use crate::geometry::{Frame, Point};
use crate::rate::due;
use crate::render::{Exposure, Raster, RenderedWorld, Visible};
use crate::robot::CameraDescription;
use crate::surroundings::Surroundings;
use crate::viewpoint::{CameraMotion, CameraPose};

/// Standard deviations of a camera's nodding on the roughest ground at 1 m/s.
/// Angle, rad, and rate, rad/s.
const NOD: [f64; 2] = [0.02, 0.8];

/// Camera with the head that carries it.
/// The time of an image is the middle of its exposure.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct CameraSensor {
    description: CameraDescription,
    random: Random,
    head: Option<PanTiltHead>,
    /// Time of the last image, ns.
    last: Option<u64>,
    /// Constants and scratch memory.
    #[serde(skip)]
    optics: Option<CameraOptics>,
    /// Faults between it and its readers.
    pub display: Display<Vec<u8>>,
}

#[derive(Debug)]
struct CameraOptics {
    world: Arc<RenderedWorld>,
    exposure: Exposure,
    raster: Raster,
    visible: Visible,
    /// Pixels of the newest image: red, green and blue of each.
    pixels: Vec<u8>,
}

impl Measurement for Vec<u8> {
    fn is_none(&self) -> bool {
        self.is_empty()
    }

    /// Blackens the image.
    fn spoil(&mut self) {
        self.fill(0);
    }
}

impl CameraSensor {
    /// Creates the camera of a robot; `random` is the stream of its noise.
    pub fn new(description: &CameraDescription, world: Arc<RenderedWorld>, random: Random) -> Self {
        let head = description.head.map(PanTiltHead::new);
        let mut camera = Self {
            description: description.clone(),
            random,
            head,
            last: None,
            optics: None,
            display: Display::default(),
        };
        camera.open(world);
        camera
    }

    fn open(&mut self, world: Arc<RenderedWorld>) {
        let (exposure, raster) = Exposure::new(&self.description);
        let pixels = Vec::with_capacity(self.description.bytes());
        self.optics = Some(CameraOptics { world, exposure, raster, visible: Visible::default(), pixels });
    }

    /// Takes over the world and the optics, which are no state, from the same camera.
    pub fn set_world_of(&mut self, other: &Self) {
        if let Some(optics) = &other.optics {
            self.open(optics.world.clone());
        }
    }

    /// Returns mount, lens and noise.
    pub fn description(&self) -> &CameraDescription {
        &self.description
    }

    /// Returns the time of the last image, ns.
    pub fn last(&self) -> Option<u64> {
        self.last
    }

    /// Returns the newest image, row by row from the top.
    /// Each pixel has red, green and blue.
    pub fn pixels(&self) -> &[u8] {
        self.optics.as_ref().map_or(&[], |optics| &optics.pixels)
    }

    /// Returns the newest image with faults.
    pub fn shown(&mut self, now: u64) -> Option<&[u8]> {
        let optics = self.optics.as_ref()?;
        self.display.show(&optics.pixels, now).map(Vec::as_slice)
    }

    /// Sets pan and tilt of its head, rad.
    pub fn command(&mut self, angles: [f64; 2]) {
        if let Some(head) = &mut self.head {
            head.command(angles);
        }
    }

    /// Moves its head for `seconds`.
    pub fn advance(&mut self, seconds: f64) {
        if let Some(head) = &mut self.head {
            head.advance(seconds);
        }
    }

    /// Returns pan and tilt, rad, and their rates, rad/s; `None` without a head.
    pub fn head(&self) -> Option<([f64; 2], [f64; 2])> {
        self.head.as_ref().map(|head| (head.angles(), head.rates()))
    }

    /// Takes an image from robot number `own` if one is due.
    /// `body` is its motion, and `shaking` how much the ground shakes it.
    pub fn measure(
        &mut self,
        own: usize,
        (body, shaking): (Motion, f64),
        surroundings: &Surroundings,
        now: u64,
    ) {
        if !due(self.description.rate, 0.0, self.last, now) {
            return;
        }
        self.last = Some(now);
        let frame = *surroundings.robots()[own].frame();
        // Even ground draws nothing from the stream.
        let [nod, rate] = match shaking > 0.0 {
            true => NOD.map(|deviation| deviation * shaking * self.random.normal()),
            false => [0.0; 2],
        };
        let pose = self.pose(&frame, nod);
        let mut motion = self.motion(&pose, body);
        motion.angular[0] -= rate;
        let Some(CameraOptics { world, exposure, raster, visible, pixels }) = &mut self.optics else {
            return;
        };
        world.draw(own, surroundings, &pose, now as f64 * 1e-9, visible, raster);
        exposure.expose(raster, &motion, &mut self.random, pixels);
    }

    /// Returns the pose of the camera on a robot in that frame.
    /// It nods down by the angle `nod`, rad.
    pub fn pose(&self, frame: &Frame, nod: f64) -> CameraPose {
        let [x, y, z, yaw, pitch] = self.description.mount;
        let Point { x, y } = frame.apply(Point::new(x, y));
        let [pan, tilt] = self.head.map_or([0.0; 2], |head| head.angles());
        let heading = slate_module::math::atan2(frame.sin, frame.cos);
        CameraPose::new([x, y, z], heading + yaw.to_radians() + pan, pitch.to_radians() + tilt + nod)
    }

    /// Returns the twist of the camera from the motions of body and head.
    fn motion(&self, pose: &CameraPose, body: Motion) -> CameraMotion {
        let velocity = body.at(Point::new(pose.origin[0], pose.origin[1]));
        let [pan_rate, tilt_rate] = self.head.map_or([0.0; 2], |head| head.rates());
        // The head tilts about its y axis, which points to the left of the image.
        let [right, down, forward] = pose.turn([0.0, 0.0, body.angular + pan_rate]);
        CameraMotion {
            linear: pose.turn([velocity.x, velocity.y, 0.0]),
            angular: [right - tilt_rate, down, forward],
        }
    }
}
