//! Trails of a run's robots with their routes, for displays that open later.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use serde::Serialize;
use serde_json::{Value, json};
use slate_report::Route;
use slate_sorted::SortedMap;

use crate::observation::Observation;

/// Sampling period of the robots' poses.
const SAMPLE_PERIOD: Duration = Duration::from_millis(50);

/// Maximum number of points of a robot.
/// When there are more, every second one is dropped, and the sampling rate is halved.
const MAX_SAMPLES: usize = 8192;

/// Columns of a table, a row for each time.
#[derive(Default, Serialize)]
struct Trail {
    /// Nanoseconds of the agent's time.
    time: Vec<u64>,
    x: Vec<f64>,
    y: Vec<f64>,
    theta: Vec<f64>,
    route: Vec<Option<&'static str>>,
    /// Number of samples from one point to the next.
    #[serde(skip)]
    every: u64,
    #[serde(skip)]
    looks: u64,
}

impl Trail {
    fn add(&mut self, time: u64, [x, y, theta]: [f64; 3], route: Option<&'static str>) {
        if self.time.last().is_some_and(|last| *last >= time) {
            if self.time.last() == Some(&time) {
                return;
            }
            // It continues from a snapshot: what came later has not been.
            let left = self.time.partition_point(|before| *before < time);
            self.keep(|index| index < left);
        }
        let is_switch = self.route.last().is_some_and(|last| *last != route);
        self.looks += 1;
        if !is_switch && !self.looks.is_multiple_of(self.every.max(1)) {
            return;
        }
        if self.time.len() >= MAX_SAMPLES {
            self.keep(|index| index.is_multiple_of(2));
            self.every = self.every.max(1) * 2;
        }
        self.time.push(time);
        self.x.push(x);
        self.y.push(y);
        self.theta.push(theta);
        self.route.push(route);
    }

    fn keep(&mut self, is_kept: impl Fn(usize) -> bool) {
        fn only<T>(all: &mut Vec<T>, is_kept: &impl Fn(usize) -> bool) {
            let mut index = 0..;
            all.retain(|_| index.next().is_some_and(is_kept));
        }
        only(&mut self.time, &is_kept);
        only(&mut self.x, &is_kept);
        only(&mut self.y, &is_kept);
        only(&mut self.theta, &is_kept);
        only(&mut self.route, &is_kept);
    }
}

type SharedTrails = Arc<Mutex<SortedMap<String, Trail>>>;

/// Trail recorder of the robots, until dropped.
/// It reads as tools do, so the run never waits for it.
pub struct Trails {
    all: SharedTrails,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Trails {
    pub fn follow(observation: Arc<Observation>, clock: impl Fn() -> u64 + Send + 'static) -> Self {
        let (all, stop) = (SharedTrails::default(), Arc::new(AtomicBool::new(false)));
        let (trails, stopped) = (Arc::clone(&all), Arc::clone(&stop));
        let follow = move || {
            while !stopped.load(Ordering::Acquire) {
                extend_trails(&observation, clock(), &mut locked(&trails));
                std::thread::sleep(SAMPLE_PERIOD);
            }
        };
        let thread = std::thread::Builder::new().name("trails".into()).spawn(follow).ok();
        Self { all, stop, thread }
    }

    /// Returns a function that reads the trails as JSON.
    pub fn reader(&self) -> Arc<dyn Fn() -> Value + Send + Sync> {
        let all = Arc::clone(&self.all);
        Arc::new(move || json!({ "robots": &*locked(&all) }))
    }
}

impl Drop for Trails {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A failed robot follows no leader.
            let _ = thread.join();
        }
    }
}

fn locked(all: &Mutex<SortedMap<String, Trail>>) -> MutexGuard<'_, SortedMap<String, Trail>> {
    all.lock().unwrap_or_else(PoisonError::into_inner)
}

fn extend_trails(observation: &Observation, time: u64, all: &mut SortedMap<String, Trail>) {
    for robot in &observation.robots {
        let Some(now) = robot.now() else { continue };
        let trail = all.entry(robot.name.clone()).or_default();
        trail.add(time, [now.x, now.y, now.theta], now.route.map(Route::name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trail(times: impl Iterator<Item = u64>) -> Trail {
        let mut trail = Trail::default();
        times.for_each(|time| trail.add(time, [time as f64, 0.0, 0.0], Some("reactive")));
        trail
    }

    #[test]
    fn a_long_run_has_fewer_points_from_its_start_to_its_end() {
        let trail = trail(1..=50_000);
        assert!((MAX_SAMPLES / 2..=MAX_SAMPLES).contains(&trail.time.len()), "{}", trail.time.len());
        assert_eq!(trail.time[0], 1);
        assert!(trail.time.last().is_some_and(|last| *last > 49_980));
        assert!(
            trail.time.is_sorted() && trail.x.len() == trail.time.len() && trail.route.len() == trail.x.len()
        );
    }

    #[test]
    fn a_switch_of_the_route_is_never_left_out() {
        let mut trail = trail(1..=50_000);
        trail.add(50_001, [0.0; 3], Some("deliberative"));
        assert_eq!((trail.time.last(), trail.route.last()), (Some(&50_001), Some(&Some("deliberative"))));
    }

    #[test]
    fn restore_drops_later_history() {
        let mut trail = trail(1..=100);
        trail.add(40, [0.0; 3], None);
        assert_eq!((trail.time.len(), trail.time.last()), (40, Some(&40)));
        // The time stands still while a recording is paused.
        trail.add(40, [1.0; 3], None);
        assert_eq!(trail.time.len(), 40);
    }
}
