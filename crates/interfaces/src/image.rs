use slate_module::interface;

/// How the pixels of an image lie in memory.
#[interface]
pub enum ImageFormat {
    /// A byte of brightness.
    Mono8,
    /// A byte each of red, green and blue.
    Rgb8,
}

impl ImageFormat {
    /// How many bytes a pixel has; 0 for a format that is not known.
    pub fn pixel_size(self) -> usize {
        match self {
            Self::MONO8 => 1,
            Self::RGB8 => 3,
            _ => 0,
        }
    }
}

/// What a camera saw.
#[interface(ros = "sensor_msgs/msg/Image")]
pub struct Image {
    /// How many pixels a row has.
    pub width: u32,
    /// How many rows there are.
    pub height: u32,
    /// From the beginning of a row to that of the next.
    #[unit("byte")]
    pub step: u32,
    /// How the pixels lie in a row.
    pub format: ImageFormat,
    /// Not used.
    pub reserved: [u8; 3],
    /// The rows, from the top; pixels from the left.
    pub data: [u8],
}

impl Image {
    /// The pixels of a row; fewer than it should have, down to none, when the image says more than it holds.
    pub fn row(&self, y: u32) -> &[u8] {
        let start = (y as usize).saturating_mul(self.step as usize).min(self.data.len());
        let length = (self.width as usize).saturating_mul(self.format.pixel_size());
        &self.data[start..start.saturating_add(length).min(self.data.len())]
    }
}
