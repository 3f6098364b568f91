//! Latency of waking a sleeping thread.
//! One thread wakes, the other one sleeps on another core and reads the clock when it runs.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use slate_blackboard::Shape;
use slate_blackboard::message::Mailbox;
use slate_blackboard::wake::Wake;
use slate_module::Plugin;
use slate_module::prelude::*;
use slate_runtime::{Agent, Control, Mode, Options};

use super::agents;
use crate::machine::{futex_wait, futex_wake, now, pin};
use crate::measure::{Contest, Effort, Samples, allocations, consume};
use crate::table::{Role, Table};

const WORK: &str = "wake-up";

/// Measures all lines.
pub fn run(effort: Effort, table: &mut Table) {
    pin(0);
    let rounds = effort.count(1000);
    let mut contest = Contest::new(WORK, "a message of 64 B to a thread that sleeps on another core");
    contest.with("Slate, a message and its wake-up", Role::Slate, move |samples| slate(rounds, samples));
    contest.with("futex, nothing else", Role::Floor, move |samples| futex(rounds, samples));
    contest.with("crossbeam channel", Role::Peer, move |samples| crossbeam(rounds, samples));
    contest
        .with("tokio channel, a run time for the thread", Role::Peer, move |samples| tokio(rounds, samples));
    contest.with("iceoryx2 event, without the value", Role::Lesser, move |samples| iceoryx(rounds, samples));
    contest.run(effort, table);

    crate::machine::unpin();
    let rounds = effort.count(300);
    let mut contest =
        Contest::new(WORK, "a value of a module in the main loop to one that waits for it, threaded");
    contest.with("Slate", Role::Slate, move |samples| module(rounds, samples));
    contest.with("futex, nothing else", Role::Floor, move |samples| paced_futex(rounds, samples));
    contest.run(effort, table);
}

/// The thread that sleeps, and when it ran last.
struct Sleeper {
    woken: Arc<AtomicU64>,
    thread: JoinHandle<()>,
}

impl Sleeper {
    fn start<W: FnMut()>(rounds: usize, waiting: impl FnOnce() -> W + Send + 'static) -> Self {
        let woken = Arc::new(AtomicU64::new(u64::MAX));
        let noted = Arc::clone(&woken);
        let thread = thread::spawn(move || {
            pin(1);
            let mut wait = waiting();
            noted.store(0, Ordering::Release);
            for _ in 0..rounds {
                wait();
                noted.store(now(), Ordering::Release);
            }
        });
        let ready = Self { woken, thread };
        while ready.woken.load(Ordering::Acquire) == u64::MAX {
            thread::yield_now();
        }
        ready
    }

    /// Wakes it so often, and ends with it.
    fn measure(self, rounds: usize, samples: &mut Samples, mut wake: impl FnMut()) {
        for _ in 0..rounds {
            // Until it sleeps again.
            thread::sleep(Duration::from_micros(300));
            self.woken.store(0, Ordering::Release);
            let before = allocations();
            let start = now();
            wake();
            samples.allocated(1, allocations() - before);
            let woken = loop {
                match self.woken.load(Ordering::Acquire) {
                    0 => std::hint::spin_loop(),
                    woken => break woken,
                }
            };
            samples.add(woken.saturating_sub(start));
        }
        let _ = self.thread.join();
    }
}

fn slate(rounds: usize, samples: &mut Samples) {
    let (mailbox, wake) = (Mailbox::new(Shape::fixed(64, 8), 1, 4), Arc::new(Wake::new()));
    let mut receiver = mailbox.receiver().expect("a new mailbox has no receiver");
    let mut sender = mailbox.sender().expect("one sender has its place");
    let slept = Arc::clone(&wake);
    let sleeper = Sleeper::start(rounds, move || {
        move || {
            while receiver.collect() == 0 {
                slept.wait();
            }
            receiver.messages().for_each(|message| consume(message.bytes()[0]));
        }
    });
    sleeper.measure(rounds, samples, || {
        assert!(sender.send(&[1; 64], 0, 0).is_ok(), "the last message was taken");
        wake.notify(1);
    });
}

fn futex(rounds: usize, samples: &mut Samples) {
    let word = Arc::new(AtomicU32::new(0));
    let slept = Arc::clone(&word);
    let sleeper = Sleeper::start(rounds, move || {
        let mut seen = 0;
        move || {
            while slept.load(Ordering::Acquire) == seen {
                futex_wait(&slept, seen);
            }
            seen += 1;
        }
    });
    sleeper.measure(rounds, samples, || {
        word.fetch_add(1, Ordering::Release);
        futex_wake(&word);
    });
}

fn crossbeam(rounds: usize, samples: &mut Samples) {
    let (sender, receiver) = crossbeam_channel::bounded::<[u8; 64]>(4);
    let sleeper = Sleeper::start(rounds, move || {
        move || {
            let _ = std::hint::black_box(receiver.recv());
        }
    });
    sleeper.measure(rounds, samples, || assert!(sender.send([1; 64]).is_ok(), "the receiver is there"));
}

fn tokio(rounds: usize, samples: &mut Samples) {
    let (sender, mut receiver) = tokio::sync::mpsc::channel::<[u8; 64]>(4);
    let sleeper = Sleeper::start(rounds, move || {
        let runtime = tokio::runtime::Builder::new_current_thread().build();
        let runtime = runtime.expect("a run time without drivers needs nothing of the system");
        move || {
            let _ = std::hint::black_box(runtime.block_on(receiver.recv()));
        }
    });
    sleeper
        .measure(rounds, samples, || assert!(sender.try_send([1; 64]).is_ok(), "the last message was taken"));
}

fn iceoryx(rounds: usize, samples: &mut Samples) {
    let (node, name) = super::iceoryx::node("event");
    let service = node.service_builder(&name).event().create().expect("a new service");
    let own = name;
    let sleeper = Sleeper::start(rounds, move || {
        let node = super::iceoryx::plain_node();
        let service = node.service_builder(&own).event().open().expect("it was created before");
        let listener = service.listener_builder().create().expect("there is one listener");
        move || {
            let _keep = (&node, &service);
            while listener.blocking_wait(|_| {}).is_ok_and(|count| count == 0) {}
        }
    });
    let notifier = service.notifier_builder().create().expect("there is one notifier");
    sleeper.measure(rounds, samples, || assert!(notifier.notify().is_ok(), "the listener is there"));
}

/// A moment of the machine's clock.
#[interface]
pub struct Moment {
    /// Since the machine started.
    #[unit("ns")]
    pub nanoseconds: u64,
}

/// The ports of a stimulus.
#[ports]
pub struct StimulusIo {
    moment: Output<Moment>,
}

/// Writes when it wrote.
pub struct Stimulus;

#[module(stage = SensorAcquire, every = "1ms")]
impl Module for Stimulus {
    type Io = StimulusIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &StimulusIo, _: &(), _: &Tick) -> Outcome {
        io.moment.set(Moment { nanoseconds: now() });
        Outcome::Ok
    }
}

/// The ports of a reaction.
#[ports]
pub struct ReactionIo {
    moment: Required<Moment>,
}

/// Notes how long ago its input was written.
pub struct Reaction;

#[module(stage = Act, on = moment)]
impl Module for Reaction {
    type Io = ReactionIo;
    type Params = ();
    type State = ();

    fn tick(_: &mut (), io: &ReactionIo, _: &(), _: &Tick) -> Outcome {
        let took = now() - io.moment.nanoseconds;
        if let Ok(mut times) = REACTIONS.lock() {
            times.push(took);
        }
        Outcome::Ok
    }
}

static REACTIONS: LazyLock<Mutex<Vec<u64>>> = LazyLock::new(|| Mutex::new(Vec::with_capacity(100_000)));

const PERIOD: Duration = Duration::from_millis(2);

fn module(rounds: usize, samples: &mut Samples) {
    let text = "loop.period = \"2ms\"\n[log.targets]\nconsole = false\n[modules.stimulus]\n[modules.reaction]\n[links]\n\
                \"reaction/moment\" = \"stimulus/moment\"\n";
    let plugins = [Plugin::linked::<Stimulus>(), Plugin::linked::<Reaction>()];
    let options = Options { mode: Mode::Threaded, ..Options::default() };
    let agent = Agent::load_with(&agents::database(text), &plugins, options);
    let mut agent = agent.expect("the modules of a bench fit");
    let rounds = rounds as u64;
    let end = agent.run(Box::new(
        move |cycle| {
            if cycle.number < rounds { Control::Continue } else { Control::Stop }
        },
    ));
    end.expect("the system has threads");
    if let Ok(mut times) = REACTIONS.lock() {
        times.drain(..).for_each(|took| samples.add(took));
    }
}

/// A thread that wakes by its period wakes another one, on any cores.
fn paced_futex(rounds: usize, samples: &mut Samples) {
    let (word, sent) = (Arc::new(AtomicU32::new(0)), Arc::new(AtomicU64::new(0)));
    let (slept, moment) = (Arc::clone(&word), Arc::clone(&sent));
    let sleeper = thread::spawn(move || {
        let mut own = Samples::new();
        for round in 0..rounds as u32 {
            while slept.load(Ordering::Acquire) == round {
                futex_wait(&slept, round);
            }
            own.add(now() - moment.load(Ordering::Acquire));
        }
        own
    });
    let mut next = Instant::now();
    for _ in 0..rounds {
        next += PERIOD;
        thread::sleep(next.saturating_duration_since(Instant::now()));
        sent.store(now(), Ordering::Release);
        word.fetch_add(1, Ordering::Release);
        futex_wake(&word);
    }
    if let Ok(own) = sleeper.join() {
        samples.join(&own);
    }
}
