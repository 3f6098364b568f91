//! What an agent is made of at present, and how that changes: everything fits and is exchanged between two cycles, or
//! nothing happens.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::Access;
use slate_module::aspect::{MainLoop, Service, TimeSource};
use slate_module::{Description, ModuleKind, Plugin};

use super::build::{Ground, Kept, build};
use super::composer::{Origin, Trial, WeakComposer};
use super::relinking::Leads;
use super::sharing::Remotes;
use super::snapshot::Watch;
pub(super) use super::target::{Changed, Fitting, Target};
use super::unlinked::Unlinked;
use crate::aspects::PlaceTime;
use crate::configuration::{Configuration, Database, Report};
use crate::isolation::Isolation;
pub(super) use crate::main_loop::Levels;
use crate::main_loop::{Seat, Shared};
use crate::playback::PlaybackControl;
use crate::plugin::KnownLibraries;
use crate::runner::ModuleCondition;
use crate::snapshot::Keepsake;
use slate_composition::Catalogue;
use slate_composition::{RESERVED, Survey, Surveyed, Wired, needs};

/// How long others, such as the watchdog, are waited for to let go of a module.
const LETTING_GO: Duration = Duration::from_secs(1);

/// A module that is there.
pub(super) struct Present {
    pub seat: Arc<Seat>,
    pub kind: ModuleKind,
    pub description: Description,
    pub own_thread: bool,
    /// How it runs apart, if it does.
    pub isolation: Option<Arc<Isolation>>,
    /// What its links are.
    pub leads: Leads,
}

impl Present {
    /// Other code as this module runs it: here or apart.
    pub fn placed(&self, kind: &ModuleKind) -> ModuleKind {
        self.isolation.as_ref().map_or_else(|| kind.clone(), |isolation| isolation.kind(kind))
    }
}

/// All that an agent is made of.
pub(super) struct Composition {
    pub configuration: Arc<Configuration>,
    pub catalogue: Catalogue,
    pub ground: Ground,
    /// By name.
    pub present: BTreeMap<String, Present>,
    /// The plugins that are linked into the program.
    pub linked: Vec<Plugin>,
    /// Libraries as they were when they were loaded last.
    pub libraries: Option<KnownLibraries>,
    /// Where the code of libraries comes from, by plugin.
    pub origins: BTreeMap<String, Origin>,
    /// Plugins whose new code runs beside the old.
    pub trials: BTreeMap<String, Trial>,
    /// The module that has the main loop, or may take it.
    pub loop_owner: Option<String>,
    /// The module that says what time it is.
    pub time_owner: Option<String>,
    /// Whether actuators that come are armed.
    pub armed: bool,
    /// The modules that read a path.
    pub listeners: BTreeMap<String, BTreeSet<String>>,
    /// Where the configuration is changed.
    pub database: Option<Database>,
    /// Why the links are not those of the configuration; they are tried again with its next change, and when a module
    /// that was in the way has returned.
    pub unlinked: Option<Unlinked>,
    /// Whether a thread waits for that.
    pub is_trying: bool,
    /// Who changes this.
    pub own: WeakComposer,
    /// What modules were that have left, to check their settings by while their code is away.
    pub last_known: BTreeMap<String, Description>,
    pub remotes: Remotes,
    /// What the application takes into snapshots.
    pub keepsakes: BTreeMap<String, Arc<dyn Keepsake>>,
    /// What takes snapshots by itself.
    pub watch: Option<Arc<Watch>>,
    /// What the playback is controlled by, if a recording is played.
    pub playback: Option<Arc<dyn PlaybackControl>>,
}

impl Composition {
    /// Of no module yet.
    pub fn new(
        configuration: Arc<Configuration>,
        catalogue: Catalogue,
        ground: Ground,
        remotes: Remotes,
        armed: bool,
    ) -> Self {
        Self {
            configuration,
            catalogue,
            ground,
            present: BTreeMap::new(),
            linked: Vec::new(),
            libraries: None,
            origins: BTreeMap::new(),
            trials: BTreeMap::new(),
            loop_owner: None,
            time_owner: None,
            armed,
            listeners: BTreeMap::new(),
            database: None,
            unlinked: None,
            is_trying: false,
            own: WeakComposer::default(),
            last_known: BTreeMap::new(),
            remotes,
            keepsakes: BTreeMap::new(),
            watch: None,
            playback: None,
        }
    }

    /// What the agent would be made of with that catalogue.
    pub fn target(&self, change: impl FnOnce(&mut Catalogue)) -> Target {
        let mut catalogue = self.catalogue.clone();
        change(&mut catalogue);
        Target { configuration: Arc::clone(&self.configuration), catalogue, keep: false }
    }

    /// The configuration of a target with the links that it leaves to types and roles. Those of modules that are there
    /// stay as they are; what would make one ambiguous is refused.
    fn wired(&self, target: &Target) -> Wired {
        Wired::new(&target.configuration, &target.catalogue, &|name| self.present.contains_key(name))
    }

    /// Whether it would fit, and what its modules would be.
    pub fn check(&self, target: &Target) -> Result<BTreeMap<String, Fitting>, Report> {
        let wired = self.wired(target);
        let survey = wired.check(&target.catalogue)?;
        let described = |surveyed: Surveyed<'_>| {
            let Surveyed { module, kind, description, setup, params, .. } = surveyed;
            (module.name.value.clone(), Fitting { kind, description, setup, params })
        };
        Ok(survey.modules.into_iter().map(described).collect())
    }

    /// Makes the agent what it shall be: modules that are new come, with the states that they shall have, and those
    /// that are no longer meant go. What stays is not touched.
    pub fn change(
        &mut self,
        target: Target,
        shared: &Arc<Shared>,
        states: &BTreeMap<String, Result<Vec<u8>, String>>,
    ) -> Result<Changed, Report> {
        let wired = self.wired(&target);
        let configuration = wired.configuration();
        let survey = wired.check(&target.catalogue)?;
        let names: Vec<&str> =
            survey.modules.iter().map(|surveyed| surveyed.module.name.value.as_str()).collect();
        let arriving: Vec<usize> =
            (0..names.len()).filter(|index| !self.present.contains_key(names[*index])).collect();
        if let Err(module) = self.deepen(configuration, &survey, shared) {
            return Err(Unlinked::late(&module).report);
        }
        let standing = self.standing();
        let built = build(configuration, &survey, &mut self.ground, &arriving);
        let mut runners = match built {
            Ok(runners) => runners,
            Err(diagnostics) => {
                self.undo(&standing, arriving.iter().map(|index| names[*index]));
                return Err(Report::from(diagnostics));
            }
        };
        let mut changed = Changed::default();
        for runner in &mut runners {
            let Some(Ok(state)) = states.get(&*runner.name) else { continue };
            changed.restored.insert(runner.name.to_string(), runner.restore(state));
        }
        for (index, runner) in arriving.iter().zip(runners) {
            let surveyed = &survey.modules[*index];
            let isolation = runner.supervised.as_ref().map(|supervised| Arc::clone(&supervised.isolation));
            let present = Present {
                seat: Arc::new(Seat::new(runner)),
                kind: surveyed.kind.clone(),
                description: surveyed.description.clone(),
                own_thread: self.ground.has_own_thread(surveyed),
                isolation,
                leads: survey.leads(configuration, *index),
            };
            changed.arrived.push(names[*index].to_owned());
            self.present.insert(names[*index].to_owned(), present);
        }
        let stays: BTreeSet<&str> = names.iter().copied().collect();
        let (staying, leaving): (BTreeMap<_, _>, BTreeMap<_, _>) = std::mem::take(&mut self.present)
            .into_iter()
            .partition(|(name, _)| stays.contains(name.as_str()));
        self.present = staying;
        let stages = self.stages(&survey);
        if self.armed {
            // A stop that is still latched keeps them disarmed.
            self.ground.actuators.values().filter(|actuator| !standing.1.contains(actuator.name())).for_each(
                |actuator| {
                    actuator.arm();
                },
            );
        }
        self.ground.means.actuators.set(self.ground.actuators.clone());
        let actuators = self.ground.actuators.values().cloned().collect();
        let threaded = self.present.values().filter(|present| present.own_thread);
        shared.compose(stages, threaded.map(|present| Arc::clone(&present.seat)).collect(), actuators);
        self.connect_loop(shared);
        for name in &changed.arrived {
            let present = &self.present[name];
            if present.own_thread
                && shared.is_running()
                && let Err(error) = shared.threads().start(shared, &present.seat)
            {
                let text = format!("the thread of {name} can't be started: {error}");
                shared.logger.log(shared.clock.now(), slate_module::Level::Error, &text);
            }
        }
        for (name, present) in leaving {
            self.last_known.insert(name.clone(), present.description.clone());
            let state = self.dispose(&name, present, shared, target.keep);
            changed.left.insert(name, state);
        }
        self.listeners = listeners(&survey);
        self.forget(&survey.absent.iter().map(|absent| absent.path.as_str()).collect(), &changed.left);
        self.configuration = Arc::clone(configuration);
        self.catalogue = target.catalogue;
        self.ground.means.plugins.show(self.catalogue.list());
        if self.present.len() > arriving.len() {
            // Links of modules that stay to parts of what came or left.
            self.settle_links(configuration, shared);
        } else {
            (self.remotes.misfits, self.unlinked) = (survey.misfits, None);
        }
        Ok(changed)
    }

    /// What the loop runs of the modules that are there, stage by stage.
    pub fn stages(&self, survey: &Survey<'_>) -> Vec<Levels> {
        let on_loop = |level: &Vec<usize>| {
            let names = level.iter().map(|index| survey.modules[*index].module.name.value.as_str());
            names
                .map(|name| &self.present[name])
                .filter(|present| !present.own_thread || present.seat.is_kicked())
                .map(|present| Arc::clone(&present.seat))
                .collect()
        };
        survey.order.iter().map(|levels| levels.iter().map(on_loop).collect()).collect()
    }

    /// Lets the loop ask the module that has the aspect for it, and the one that has the time.
    fn connect_loop(&mut self, shared: &Arc<Shared>) {
        let of = |schema: u64| {
            let mut all = self.present.iter();
            all.find(|(_, present)| needs(&present.description, schema))
        };
        let seat = |present: &Present| (!present.own_thread).then(|| Arc::clone(&present.seat));
        let taker = of(MainLoop::DESCRIPTOR.hash).map(|(name, present)| (name.clone(), &present.seat));
        let time = of(TimeSource::DESCRIPTOR.hash).map(|(name, present)| (name.clone(), seat(present)));
        let (loop_owner, time_owner) =
            (taker.as_ref().map(|(name, _)| name.clone()), time.as_ref().map(|(name, _)| name.clone()));
        if loop_owner != self.loop_owner {
            let place = taker
                .and_then(|(name, seat)| Some((self.ground.means.takeovers.get(&name)?, Arc::clone(seat))));
            shared.set_takeover(place);
        }
        if time_owner != self.time_owner {
            match time {
                Some((_, seat)) => {
                    let code = PlaceTime(Arc::clone(&self.ground.means.time));
                    shared.set_time_source(Some(Box::new(code)), seat);
                }
                None => shared.set_time_source(None, None),
            }
        }
        (self.loop_owner, self.time_owner) = (loop_owner, time_owner);
    }

    /// What users and tools have set in those modules: parameters, `enabled`, inputs without a link.
    pub fn settings(&self, modules: &[String]) -> BTreeMap<String, Kept> {
        let of = |path: &str| {
            let within =
                |module: &String| path.strip_prefix(module).is_some_and(|rest| rest.starts_with('/'));
            modules.iter().any(within)
        };
        let properties = self.ground.board.properties();
        let settings =
            properties.iter().filter(|property| property.access() == Access::Setting && of(property.path()));
        let kept = settings.filter_map(|property| {
            let (bytes, _, stamp) = property.newest().ok().flatten()?;
            let schema = property.descriptor().hash;
            Some((property.path().to_owned(), Kept { schema, bytes, time: stamp.time }))
        });
        kept.collect()
    }

    /// The paths and the actuators that there are.
    pub fn standing(&self) -> (BTreeSet<String>, BTreeSet<String>) {
        (self.paths(), self.ground.actuators.keys().cloned().collect())
    }

    fn paths(&self) -> BTreeSet<String> {
        let board = &self.ground.board;
        let aliases = board.aliases().into_iter().map(|(path, _)| path);
        board.properties().iter().map(|property| property.path().to_owned()).chain(aliases).collect()
    }

    /// After a change that failed: nothing of it stays.
    pub fn undo<'n>(
        &mut self,
        (paths, actuators): &(BTreeSet<String>, BTreeSet<String>),
        arriving: impl Iterator<Item = &'n str>,
    ) {
        for path in self.paths().difference(paths) {
            // It was there a moment ago, and nobody else takes it off.
            let _ = self.ground.board.remove(path);
        }
        self.ground.actuators.retain(|name, _| actuators.contains(name));
        for name in arriving {
            self.ground.post(name).health.set(ModuleCondition::UNLOADED);
        }
    }

    /// Ends a module that the loop runs no more; returns its state, if that is to be kept.
    fn dispose(
        &mut self,
        name: &str,
        present: Present,
        shared: &Shared,
        keep: bool,
    ) -> Result<Vec<u8>, String> {
        let Present { seat, own_thread, .. } = present;
        if own_thread {
            seat.retire();
            shared.threads().join_one(&seat, self.ground.hang, shared.clock.now());
        }
        if seat.is_late() {
            let text = format!("{name} has not returned from its last call; its library stays open");
            shared.logger.log(shared.clock.now(), slate_module::Level::Error, &text);
            // Its thread still refers to it, and so does the library to which that may return.
            std::mem::forget(seat);
            return Err("its tick has not returned".into());
        }
        let Some(mut runner) = seat.into_runner(LETTING_GO) else {
            return Err("it is still in use".into());
        };
        let now = shared.clock.now();
        runner.set_condition(ModuleCondition::UNLOADED, now);
        runner.publish_safe(now);
        self.ground.post(name).health.set(ModuleCondition::UNLOADED);
        let retired = runner.retire();
        // Its ports are free for others, also when its last calls don't return.
        drop(runner);
        if keep { retired.save() } else { Ok(Vec::new()) }
    }

    /// Takes the properties of modules that have left off the board, but for those that others read.
    fn forget(&mut self, absent: &BTreeSet<&str>, left: &BTreeMap<String, Result<Vec<u8>, String>>) {
        for name in left.keys() {
            for path in self.paths() {
                let own = path.strip_prefix(name.as_str()).and_then(|rest| rest.strip_prefix('/'));
                let is_of_another = self.present.keys().any(|other| path.starts_with(&format!("{other}/")));
                if own.is_none() || is_of_another || absent.contains(path.as_str()) {
                    continue;
                }
                // The state of a module that has left says so.
                if own != Some(RESERVED[2]) {
                    // As above.
                    let _ = self.ground.board.remove(&path);
                }
            }
        }
    }
}

/// The modules that read a path.
pub(super) fn listeners(survey: &Survey<'_>) -> BTreeMap<String, BTreeSet<String>> {
    let owned = |names: &Vec<&str>| names.iter().map(|name| (*name).to_owned()).collect();
    survey.listeners.iter().map(|(path, names)| (path.clone(), owned(names))).collect()
}
