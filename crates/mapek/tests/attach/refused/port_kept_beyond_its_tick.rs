#[path = "../robot.rs"]
mod robot;
use robot::*;
use slate_mapek::prelude::*;
use slate_module::prelude::*;

#[derive(Default, serde::Serialize, serde::Deserialize)]
struct Hoard {
    #[serde(skip)]
    kept: Option<&'static Near>,
}

struct Hoarder;

impl Analyze for Hoarder {
    const NAME: &'static str = "hoarder";
    type Observed = ObservedRange;
    type Params = ();
    type State = Hoard;
    type Value = Near;

    fn process(state: &mut Hoard, observed: &ObservedRange, _: &(), _: &Tick) -> Option<Near> {
        state.kept = observed.range.fresh();
        None
    }
}

fn main() {}
