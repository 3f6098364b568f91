//! Copper application with one task that does nothing at 100 Hz.
//! It prints a line after its first cycle, and ends when its input ends.

use std::io::Read;
use std::process::ExitCode;

use cu29::prelude::*;

/// Does nothing.
#[derive(Reflect)]
pub struct Idle {
    cycles: u64,
}

impl Freezable for Idle {}

impl CuSrcTask for Idle {
    type Resources<'r> = ();
    type Output<'m> = output_msg!(u8);

    fn new(_: Option<&ComponentConfig>, (): ()) -> CuResult<Self> {
        Ok(Self { cycles: 0 })
    }

    fn process(&mut self, _: &CuContext, _: &mut Self::Output<'_>) -> CuResult<()> {
        Ok(())
    }

    fn postprocess(&mut self, _: &CuContext) -> CuResult<()> {
        self.cycles += 1;
        if self.cycles == 1 {
            println!("runs");
        }
        Ok(())
    }
}

#[copper_runtime(config = "idle.ron")]
struct Minimal {}

fn run() -> CuResult<()> {
    let app = Minimal::builder().build()?;
    std::thread::spawn(|| {
        let _ = std::io::stdin().read(&mut [0]);
        // Its loop ends with a signal, or with the process.
        std::process::exit(0);
    });
    app.run_until_shutdown().map(drop).map_err(|failure| failure.into())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:?}");
            ExitCode::FAILURE
        }
    }
}
