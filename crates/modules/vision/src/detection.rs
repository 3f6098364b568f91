use slate_module::{Sequence, Text, interface};

/// Detection in an image, with its box.
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
    /// Confidence, 0 to 1.
    pub confidence: f64,
    /// Label: `victim`, `qr` with its text, or `tag` with its number.
    pub label: Text<60>,
}

/// Detections in an image, the most confident first.
#[interface]
#[derive(PartialEq)]
pub struct ImageDetections {
    /// Time of the image.
    #[unit("ns")]
    pub time: u64,
    /// Detections.
    pub list: Sequence<ImageDetection, 16>,
}

/// Sharpness of an image.
#[interface]
#[derive(PartialEq)]
pub struct ImageSharpness {
    /// Sharpness: variance of the Laplacian of the brightness.
    /// Brightness is from 0 to 255 (Pech-Pacheco et al., 2000, *Diatom autofocusing in brightfield microscopy*); it is
    /// low in blurred images.
    pub laplacian_variance: f64,
}

/// Texture of the floor before a camera.
#[interface]
#[derive(PartialEq)]
pub struct TerrainTexture {
    /// Contrast of the lowest quarter of the image, high on rough ground.
    /// Mean difference of neighboring pixels, relative to their mean.
    pub contrast: f64,
}
