use slate_module::{Sequence, Text, interface};

/// Something that was found in an image: its box.
#[interface]
#[derive(PartialEq)]
pub struct ImageDetection {
    /// Middle of the box, from the left.
    #[unit("px")]
    pub x: f64,
    /// Middle of the box, from the top.
    #[unit("px")]
    pub y: f64,
    /// Width of the box.
    #[unit("px")]
    pub width: f64,
    /// Height of the box.
    #[unit("px")]
    pub height: f64,
    /// How sure it is, 0 to 1.
    pub confidence: f64,
    /// What it is: `victim`, or `qr` with its text.
    pub label: Text<60>,
}

/// What was found in an image, the surest first.
#[interface]
#[derive(PartialEq)]
pub struct ImageDetections {
    /// Time of the image.
    #[unit("ns")]
    pub time: u64,
    /// The detections.
    pub list: Sequence<ImageDetection, 16>,
}

/// Sharpness of an image.
#[interface]
#[derive(PartialEq)]
pub struct ImageSharpness {
    /// Variance of the Laplacian of the brightness, from 0 to 255 (Pech-Pacheco et al., 2000, *Diatom autofocusing in brightfield
    /// microscopy*); low in blurred images.
    pub laplacian_variance: f64,
}

/// Texture of the floor before a camera.
#[interface]
#[derive(PartialEq)]
pub struct TerrainTexture {
    /// Mean difference of neighbouring pixels, relative to their mean, in the lowest quarter of the image: high on rough
    /// ground.
    pub contrast: f64,
}
