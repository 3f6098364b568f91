//! Software renderer of worlds for cameras.

mod code;
mod exposure;
mod figure;
mod materials;
mod noise;
mod panels;
mod raster;
mod rendered_world;
mod texture;

pub(crate) use exposure::Exposure;
pub(crate) use raster::Raster;
pub use rendered_world::RenderedWorld;
pub(crate) use rendered_world::Visible;
