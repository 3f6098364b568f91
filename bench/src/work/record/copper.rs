//! Copper's camera with all images logged, by its macro.

use std::path::Path;
use std::sync::Arc;

use cu29::prelude::*;

use super::IMAGE;

/// Takes pictures.
#[derive(Reflect)]
pub struct Camera {
    images: Arc<CuHostMemoryPool<Vec<u8>>>,
    taken: usize,
}

impl Freezable for Camera {}

impl CuSrcTask for Camera {
    type Resources<'r> = ();
    type Output<'m> = output_msg!(CuHandle<Vec<u8>>);

    fn new(_: Option<&ComponentConfig>, (): ()) -> CuResult<Self> {
        // More than there are cycles at a time.
        Ok(Self { images: CuHostMemoryPool::new("images", 8, || vec![0; IMAGE])?, taken: 0 })
    }

    fn process(&mut self, _: &CuContext, output: &mut Self::Output<'_>) -> CuResult<()> {
        let image = self.images.acquire().ok_or("all images are held")?;
        image.with_inner_mut(|bytes| bytes[self.taken % IMAGE] = 1);
        self.taken += 1;
        output.set_payload(image);
        Ok(())
    }
}

#[copper_runtime(config = "copper/camera.ron")]
struct Cameras {}

/// Starts the application; the result runs a cycle.
pub fn start(folder: &Path) -> CuResult<impl FnMut()> {
    let builder = Cameras::builder().with_log_path(folder.join("camera.copper"), Some(LOG))?;
    let mut app = builder.build()?.start()?;
    Ok(move || app.run_one_iteration().expect("its task makes no mistakes"))
}

/// Bytes that the log grows by.
const LOG: usize = 64 << 20;
