use slate_module::interface;

/// Pixel format of an image.
#[interface]
pub enum ImageFormat {
    /// One byte of brightness.
    Mono8,
    /// One byte each of red, green and blue.
    Rgb8,
}

impl ImageFormat {
    /// Returns the bytes of a pixel; 0 for an unknown format.
    pub fn pixel_size(self) -> usize {
        match self {
            Self::MONO8 => 1,
            Self::RGB8 => 3,
            _ => 0,
        }
    }
}

/// Image of a camera.
#[interface(ros = "sensor_msgs/msg/Image")]
pub struct Image {
    /// Pixels of a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Bytes of a row, with padding.
    #[unit("byte")]
    pub step: u32,
    /// Pixel format.
    pub format: ImageFormat,
    /// Rows from the top; pixels from the left.
    pub data: [u8],
}

impl Image {
    /// Returns the pixels of a row; fewer, down to none, if `data` is too short.
    pub fn row(&self, y: u32) -> &[u8] {
        let start = (y as usize).saturating_mul(self.step as usize).min(self.data.len());
        let length = (self.width as usize).saturating_mul(self.format.pixel_size());
        &self.data[start..start.saturating_add(length).min(self.data.len())]
    }
}
