//! Aspect [`MainLoop`]: a module takes the main loop over.

use std::sync::Arc;
use std::time::Duration;

use slate_module::aspect::{LoopPlace, MainLoop, PolicyTable, StageTable};
use slate_module::table::{Bytes, DONE, REFUSED, Sink};
use slate_module::{ModuleKind, Stage};

use super::calls::{say, text};
use super::{HostService, ServiceContext, in_place};
use slate_configuration::{Schedule, ScheduledStage};
use slate_engine::digest::Digest;

use slate_engine::main_loop::{LoopPolicy, LoopPosition, Takeover, Takeovers};

/// Result of a policy after a panic.
const PANICKED: i32 = -2;

/// Policy of a module.
struct ModulePolicy {
    table: PolicyTable,
    /// The names of the stages, as the module sees them.
    names: Vec<Bytes>,
    /// Module kind, which keeps the code of the policy's calls.
    #[allow(dead_code, reason = "it is kept, not used")]
    kind: Option<ModuleKind>,
}

// SAFETY: a policy is `Send`, as the module's side demands; the names point to the loop's own, and are only looked at
// during a call that lends those.
unsafe impl Send for ModulePolicy {}

impl Drop for ModulePolicy {
    fn drop(&mut self) {
        // SAFETY: the policy ends once, and its code is kept.
        unsafe { (self.table.end)(self.table.owner) }
    }
}

impl LoopPolicy for ModulePolicy {
    fn next(&mut self, place: &LoopPosition<'_>) -> Option<usize> {
        self.names.clear();
        self.names.extend(place.stages.iter().map(|name| Bytes::of(name)));
        // SAFETY: the names stay unchanged until the place is gone.
        let seen = unsafe { LoopPlace::new(&self.names, place.after, place.now, place.cycle) };
        // SAFETY: the policy was not ended, and the place lives during the call.
        let next = unsafe { (self.table.next)(self.table.owner, &raw const seen) };
        if next == PANICKED {
            // As a policy of the program does; it was reported when it happened.
            std::panic::resume_unwind(Box::new("the policy of a module"));
        }
        usize::try_from(next).ok()
    }
}

/// Request of a tick.
enum TakeoverRequest {
    Take(Box<ModulePolicy>, Option<Schedule>),
    GiveBack,
}

struct LoopService {
    table: MainLoop,
    takeovers: Arc<Takeovers>,
    takeover: Arc<Takeover>,
    /// The module's code.
    kind: Option<ModuleKind>,
    requested: Option<TakeoverRequest>,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for LoopService {}

pub(super) fn make(service_context: &ServiceContext, module: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| LoopService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { MainLoop::new(context, take, take_with_policy, give_back, is_held) },
        takeovers: Arc::clone(&service_context.takeovers),
        takeover: service_context.takeovers.add(module),
        kind: None,
        requested: None,
    })
}

impl HostService for LoopService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn begin(&mut self, kind: &ModuleKind) {
        self.abandon();
        self.kind = Some(kind.clone());
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        match self.requested.take() {
            Some(TakeoverRequest::Take(policy, stages)) => self.takeover.take(policy, stages),
            Some(TakeoverRequest::GiveBack) => self.takeover.release(),
            None => {}
        }
    }

    fn abandon(&mut self) {
        self.requested = None;
        self.takeover.release();
    }

    fn release(&self, _: u64) {
        self.takeover.suspend();
    }

    fn end(&mut self) {
        self.abandon();
    }
}

impl Drop for LoopService {
    fn drop(&mut self) {
        self.abandon();
        self.takeovers.remove(&self.takeover);
    }
}

impl LoopService {
    fn policy(&self, table: PolicyTable) -> Box<ModulePolicy> {
        Box::new(ModulePolicy { table, names: Vec::new(), kind: self.kind.clone() })
    }
}

/// Makes the schedule of a module's stages.
///
/// # Safety
/// All of it is readable during the call.
unsafe fn schedule(stages: &[StageTable]) -> Result<Schedule, String> {
    let stage = |stage: &StageTable| {
        let members = match stage.member_count {
            0 => &[][..],
            // SAFETY: passed on to the caller.
            count => unsafe { std::slice::from_raw_parts(stage.members, count) },
        };
        // SAFETY: as above.
        let name = unsafe { text(stage.name) };
        let member = |number: &u32| {
            let member = usize::try_from(*number).ok().and_then(|number| Stage::ALL.get(number));
            member.copied().ok_or_else(|| {
                format!(
                    "`{name}` has no stage {number} of modules: they are numbered from 0 to {}",
                    Stage::ALL.len() - 1
                )
            })
        };
        let members = members.iter().map(member).collect::<Result<_, _>>()?;
        let timeout = (stage.timeout > 0).then(|| Duration::from_nanos(stage.timeout));
        Ok(ScheduledStage { name, members, timeout })
    };
    let stages = stages.iter().map(stage).collect::<Result<_, String>>()?;
    Schedule::new(stages).map_err(|error| error.to_string())
}

unsafe extern "C" fn take(
    context: *mut (),
    stages: *const StageTable,
    count: usize,
    policy: PolicyTable,
    sink: *const Sink,
) -> i32 {
    // SAFETY: the context is the service, which the module's tick uses alone; all else lives during the call.
    unsafe {
        let service = &mut *context.cast::<LoopService>();
        // It ends with this when the stages are refused.
        let policy = service.policy(policy);
        let stages = if count == 0 { &[] } else { std::slice::from_raw_parts(stages, count) };
        match schedule(stages) {
            Ok(stages) => {
                service.requested = Some(TakeoverRequest::Take(policy, Some(stages)));
                DONE
            }
            Err(reason) => {
                say(sink, &reason);
                REFUSED
            }
        }
    }
}

unsafe extern "C" fn take_with_policy(context: *mut (), policy: PolicyTable) {
    // SAFETY: as for `take`.
    let service = unsafe { &mut *context.cast::<LoopService>() };
    service.requested = Some(TakeoverRequest::Take(service.policy(policy), None));
}

unsafe extern "C" fn give_back(context: *mut ()) {
    // SAFETY: as for `take`.
    unsafe { &mut *context.cast::<LoopService>() }.requested = Some(TakeoverRequest::GiveBack);
}

unsafe extern "C" fn is_held(context: *mut ()) -> i32 {
    // SAFETY: as for `take`.
    unsafe { &*context.cast::<LoopService>() }.takeover.is_held().into()
}
