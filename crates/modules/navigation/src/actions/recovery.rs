//! Recovery behaviors of a stuck robot.

use serde::{Deserialize, Serialize};
use slate_local_planning::{RecoveryBehavior, RecoveryCommand, RecoverySequence};
use slate_plugin::prelude::*;

use crate::body::NavigationBody;
use crate::controller::ControlInputs;
use crate::local_window::LocalWindow;

/// Recovery behavior as an action.
#[derive(Serialize, Deserialize)]
struct RunningBehavior {
    behavior: RecoveryBehavior,
    /// Recovery behavior, once it has begun.
    sequence: Option<RecoverySequence>,
    #[serde(skip)]
    window: Option<Box<LocalWindow>>,
}

impl RunningBehavior {
    fn new(behavior: RecoveryBehavior) -> Self {
        Self { behavior, sequence: None, window: None }
    }

    fn step(&mut self, acting: &Acting<'_, NavigationBody>) -> Step {
        let Acting { body, priority, now } = *acting;
        let Ok(inputs) = ControlInputs::read(body) else {
            // It continues when they are well again.
            body.stand(priority);
            return Step::Running;
        };
        let pose = inputs.odometry.pose;
        let window = LocalWindow::fit(&mut self.window, inputs.settings.window_size, body);
        let window = match window {
            Ok(window) => window,
            Err(error) => return fail(&error, now),
        };
        window.update(&pose, inputs.obstacles);
        if self.sequence.is_none() {
            match RecoverySequence::new(vec![self.behavior]) {
                Ok(mut sequence) => {
                    sequence.start(&pose, now.seconds());
                    self.sequence = Some(sequence);
                }
                Err(error) => return fail(&error, now),
            }
        }
        let Some(sequence) = &mut self.sequence else { return Step::Failed };
        match sequence.step(&pose, now.seconds(), |velocity| window.is_free(&pose, velocity)) {
            RecoveryCommand::Move(velocity) => {
                body.drive(velocity, priority);
                Step::Running
            }
            RecoveryCommand::ClearCostmap => {
                body.clear_costmap(now);
                body.stand(priority);
                Step::Done
            }
            RecoveryCommand::Done => {
                body.stand(priority);
                Step::Done
            }
        }
    }
}

fn fail(error: &dyn std::fmt::Display, now: &Tick) -> Step {
    now.warn(format_args!("recovery: {error}"));
    Step::Failed
}

macro_rules! recovery {
    ($(#[$attribute:meta])* $name:ident: $arguments:ty, $pattern:pat => $behavior:expr) => {
        $(#[$attribute])*
        #[derive(Serialize, Deserialize)]
        pub struct $name(RunningBehavior);

        impl ActionKind for $name {
            const KIND: &'static str = stringify!($name);
            type Arguments = $arguments;

            fn start($pattern: $arguments) -> Self {
                Self(RunningBehavior::new($behavior))
            }
        }

        impl Action<NavigationBody> for $name {
            fn act(&mut self, acting: &Acting<'_, NavigationBody>) -> Step {
                self.0.step(acting)
            }
        }
    };
}

recovery! {
    /// Drives backwards while that is free; arguments are distance, m, and speed, m/s.
    BackUp: [f64; 2], [distance, speed] => RecoveryBehavior::BackUp { distance, speed }
}
recovery! {
    /// Turns in place while that is free; arguments are angle, rad, and speed, rad/s.
    Spin: [f64; 2], [angle, speed] => RecoveryBehavior::Spin { angle, speed }
}
recovery! {
    /// Waits for a duration, the argument, s.
    Wait: f64, duration => RecoveryBehavior::Wait { duration }
}
recovery! {
    /// Forgets the obstacles that are out of sight.
    ClearCostmap: (), () => RecoveryBehavior::ClearCostmap
}
