//! Sonars that sound one after the other.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // Tests say what went wrong by failing.

use slate_sim::geometry::Pose;
use slate_sim::robot::RobotDescription;
use slate_sim::world::World;
use slate_sim::{Placement, Simulation};

/// A Pioneer whose sonars are noisy and never fail, so that each echo is another one.
fn pioneer(rate: Option<f64>) -> Placement {
    let mut description = RobotDescription::load("pioneer_p3dx").unwrap();
    let profile = description.sonar.get_mut("real").unwrap();
    (profile.rate, profile.dropout, profile.crosstalk) = (rate, 0.0, 0.0);
    profile.maximum_incidence = 1.5;
    let pose = Pose { x: 0.2, y: 0.1, theta: 0.3 };
    Placement { name: "r".into(), description, sonar: "real".into(), pose, script: None }
}

/// Changes of each sonar's echo in 10 s, sampled each `period` steps: how many, and with how many others at most.
fn echo_changes(rate: Option<f64>, period: usize) -> Vec<(usize, usize)> {
    let world = World::load("rocs_arena").unwrap();
    let mut simulation = Simulation::new(&world, &[pioneer(rate)], 1, 10_000_000).unwrap();
    let echoes = |simulation: &Simulation| simulation.sonar(0).unwrap().0.to_vec();
    let mut last = echoes(&simulation);
    assert!(last.len() == 16 && last.iter().all(|echo| echo.heard), "all sound at first");
    let mut counts = vec![(0, 0); 16];
    for _ in 0..1000 / period {
        (0..period).for_each(|_| simulation.step());
        simulation.sense();
        let now = echoes(&simulation);
        let together = (0..16).filter(|i| now[*i] != last[*i]).count();
        for i in (0..16).filter(|i| now[*i] != last[*i]) {
            counts[i] = (counts[i].0 + 1, counts[i].1.max(together));
        }
        last = now;
    }
    counts
}

#[test]
fn sonars_fire_in_turns_at_their_rate() {
    for period in [2, 10] {
        for (count, together) in echo_changes(Some(3.0), period) {
            // 30 in 10 s; the turns at both ends may fall outside.
            assert!((29..=31).contains(&count), "{count}");
            // 48 echoes a second: at 10 Hz about 5 at once, and at 50 Hz about 1.
            assert!(together <= if period == 10 { 6 } else { 2 }, "{together}");
        }
    }
}

#[test]
fn without_a_rate_or_with_a_high_one_all_sound_at_every_sweep() {
    for rate in [None, Some(10.0), Some(1000.0)] {
        assert!(echo_changes(rate, 10).iter().all(|(count, _)| *count == 100), "{rate:?}");
    }
}

#[test]
fn a_saved_ring_goes_on_with_its_turns() {
    let world = World::load("rocs_arena").unwrap();
    let mut simulation = Simulation::new(&world, &[pioneer(Some(3.0))], 1, 10_000_000).unwrap();
    let go = |simulation: &mut Simulation| {
        for _ in 0..37 {
            (0..2).for_each(|_| simulation.step());
            simulation.sense();
        }
    };
    go(&mut simulation);
    let mut resumed: Simulation = slate_module::decode(&slate_module::encode(&simulation).unwrap()).unwrap();
    go(&mut simulation);
    go(&mut resumed);
    assert!(slate_module::encode(&simulation).unwrap() == slate_module::encode(&resumed).unwrap());
}
