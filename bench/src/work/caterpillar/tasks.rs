//! The tasks of Copper's caterpillar.

use cu29::prelude::*;

/// Counts.
#[derive(Reflect)]
pub struct First {
    number: f64,
}

impl Freezable for First {}

impl CuSrcTask for First {
    type Resources<'r> = ();
    type Output<'m> = output_msg!(f64);

    fn new(_: Option<&ComponentConfig>, (): ()) -> CuResult<Self> {
        Ok(Self { number: 0.0 })
    }

    fn process(&mut self, _: &CuContext, output: &mut Self::Output<'_>) -> CuResult<()> {
        self.number += 1.0;
        output.set_payload(self.number);
        Ok(())
    }
}

/// Passes a number on, plus one.
#[derive(Reflect)]
pub struct Segment;

impl Freezable for Segment {}

impl CuTask for Segment {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(f64);
    type Output<'m> = output_msg!(f64);

    fn new(_: Option<&ComponentConfig>, (): ()) -> CuResult<Self> {
        Ok(Self)
    }

    fn process(
        &mut self,
        _: &CuContext,
        input: &Self::Input<'_>,
        output: &mut Self::Output<'_>,
    ) -> CuResult<()> {
        if let Some(number) = input.payload() {
            output.set_payload(number + 1.0);
        }
        Ok(())
    }
}

/// Looks at the number.
#[derive(Reflect)]
pub struct Last;

impl Freezable for Last {}

impl CuSinkTask for Last {
    type Resources<'r> = ();
    type Input<'m> = input_msg!(f64);

    fn new(_: Option<&ComponentConfig>, (): ()) -> CuResult<Self> {
        Ok(Self)
    }

    fn process(&mut self, _: &CuContext, input: &Self::Input<'_>) -> CuResult<()> {
        std::hint::black_box(input.payload());
        Ok(())
    }
}
