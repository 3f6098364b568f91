//! Random uses by one thread, compared with a simple model.
#![cfg(not(any(loom, feature = "shuttle")))]
#![allow(unsafe_code, reason = "a draft is written through a pointer")]

use crate::arena;
use crate::lender;

use std::collections::BTreeSet;

use arena::Arena;
use lender::Lender;
use proptest::prelude::*;
use slate_blackboard::channel::{
    AdoptError, Budget, Channel, Evicted, Latest, Policy, QueueReader, SetAside, Start,
};
use slate_blackboard::message::{ABANDONED, Answer, Mailbox, Sender, Status, Ticket};
use slate_blackboard::{Shape, Stamp};

const SHAPE: Shape = Shape { size: 8, align: 8, item: 1, capacity: 8 };

/// The value of a sequence number: as many tail items as fit its number.
fn value(sequence: u64) -> (Vec<u8>, usize) {
    let items = (sequence % 9) as usize;
    let mut bytes = (sequence * 3).to_ne_bytes().to_vec();
    bytes.extend((0..items).map(|i| (sequence as usize + i) as u8));
    bytes.resize(SHAPE.bytes(items), 0);
    (bytes, items)
}

#[derive(Clone, Debug)]
enum Operation {
    Write,
    Adopt,
    Draft,
    Freeze,
    NewWriter,
    SetAside,
    ReturnAside,
    Refresh(usize),
    Propose(usize),
    Accept(usize),
    Reject(usize),
    NewLatest(usize),
    Pull(usize),
    Release(usize),
    NewQueue(usize, bool),
}

fn operation() -> impl Strategy<Value = Operation> {
    use Operation::*;
    prop_oneof![
        5 => Just(Write),
        5 => Just(Adopt),
        1 => Just(Draft),
        1 => Just(Freeze),
        1 => Just(NewWriter),
        1 => Just(SetAside),
        1 => Just(ReturnAside),
        3 => (0..2_usize).prop_map(Refresh),
        2 => (0..2_usize).prop_map(Propose),
        2 => (0..2_usize).prop_map(Accept),
        1 => (0..2_usize).prop_map(Reject),
        1 => (0..2_usize).prop_map(NewLatest),
        4 => (0..3_usize).prop_map(Pull),
        1 => (0..3_usize).prop_map(Release),
        1 => (0..3_usize, any::<bool>()).prop_map(|(i, oldest)| NewQueue(i, oldest)),
    ]
}

const POLICIES: [Policy; 3] = [Policy::Skip, Policy::Evict, Policy::Block];

#[derive(Default)]
struct LatestModel {
    held: u64,
    candidate: u64,
}

struct QueueModel {
    next: u64,
    window: Vec<u64>,
    skipped: u64,
    evicted: bool,
}

impl QueueModel {
    fn new(stamps: &[Stamp], depth: usize, oldest: bool) -> Self {
        let kept = stamps.len().min(depth);
        let next = stamps.len() - if oldest { kept } else { 0 } + 1;
        Self { next: next as u64, window: Vec::new(), skipped: 0, evicted: false }
    }

    fn pull(&mut self, policy: Policy, tail: u64, depth: u64, window: u64) -> Result<usize, Evicted> {
        self.window.clear();
        let oldest = tail.saturating_sub(depth) + 1;
        if self.next < oldest && !self.evicted {
            assert_ne!(policy, Policy::Block, "the writer overtook a reader that blocks");
            self.skipped += oldest - self.next;
            self.next = oldest;
            self.evicted = policy == Policy::Evict;
        }
        if self.evicted {
            return Err(Evicted);
        }
        self.window = (self.next..=tail).take(window as usize).collect();
        self.next += self.window.len() as u64;
        Ok(self.window.len())
    }
}

fn check_latest(reader: &Latest, model: &LatestModel, stamps: &[Stamp]) {
    let loan = reader.value();
    assert_eq!(loan.as_ref().map_or(0, |loan| loan.stamp().sequence), model.held);
    if let Some(loan) = loan {
        let (bytes, items) = value(model.held);
        assert_eq!((loan.bytes(), loan.items()), (&*bytes, items));
        assert_eq!(loan.stamp(), stamps[model.held as usize - 1]);
    }
    assert_eq!(reader.has_news(), stamps.len() as u64 > model.held);
}

fn check_queue(reader: &QueueReader, model: &QueueModel, stamps: &[Stamp]) {
    assert!(reader.window().map(|loan| loan.stamp().sequence).eq(model.window.iter().copied()));
    for loan in reader.window() {
        let (bytes, items) = value(loan.stamp().sequence);
        assert_eq!((loan.bytes(), loan.items()), (&*bytes, items));
        assert_eq!(loan.stamp(), stamps[loan.stamp().sequence as usize - 1]);
    }
    assert_eq!(reader.len(), model.window.len());
    assert_eq!(reader.skipped(), model.skipped);
    assert_eq!(reader.lag(), stamps.len() as u64 + 1 - model.next);
}

proptest! {
    #[test]
    fn a_channel_does_what_the_model_does(
        depth in 1..4_usize,
        window in 1..4_u16,
        given in any::<bool>(),
        operations in prop::collection::vec(operation(), 1..120),
    ) {
        let arena = Arena::new(64);
        let lender = Lender::default();
        let mut adopted = BTreeSet::new();
        let memory = given.then(|| arena.memory());
        let channel = Channel::new_in(SHAPE, depth, Budget { latest: 2, queues: 3, window }, memory);
        let mut latest = [(); 2].map(|()| channel.latest().unwrap());
        let mut queues = POLICIES.map(|policy| channel.queue(policy, Start::Next).unwrap());
        let mut writer = Some(channel.writer().unwrap());
        let mut aside: Option<SetAside> = None;
        let mut stamps: Vec<Stamp> = Vec::new();
        let mut generation = 1;
        let mut latest_models = [LatestModel::default(), LatestModel::default()];
        let mut queue_models = [(); 3].map(|()| QueueModel::new(&[], depth, false));

        for operation in operations {
            let tail = stamps.len() as u64;
            match operation {
                Operation::Write => {
                    let (bytes, items) = value(tail + 1);
                    let stamp = Stamp { sequence: tail + 1, time: tail * 10, generation };
                    let result = writer.as_mut().unwrap().write(&bytes, items, stamp.time);
                    if tail + 1 >= queue_models[2].next + depth as u64 {
                        prop_assert!(result.is_err());
                    } else {
                        prop_assert_eq!(result, Ok(stamp));
                        stamps.push(stamp);
                    }
                }
                Operation::Adopt => {
                    let (bytes, items) = value(tail + 1);
                    let stamp = Stamp { sequence: tail + 1, time: tail * 10, generation };
                    let lent = lender.lend(tail + 1, &bytes);
                    let result = writer.as_mut().unwrap().adopt(lent, items, stamp.time);
                    if given {
                        prop_assert_eq!(result, Err(AdoptError::Given));
                    } else if tail + 1 >= queue_models[2].next + depth as u64 {
                        prop_assert!(matches!(result, Err(AdoptError::Blocked(_))));
                    } else {
                        prop_assert_eq!(result, Ok(stamp));
                        stamps.push(stamp);
                        adopted.insert(tail + 1);
                    }
                    // Invisible slots are returned by now.
                    let pinned = latest_models.iter().flat_map(|model| [model.held, model.candidate]);
                    let windows = queue_models.iter().flat_map(|model| model.window.iter().copied());
                    let tail = stamps.len() as u64;
                    let ring = tail.saturating_sub(depth as u64) + 1..=tail;
                    let seen: BTreeSet<_> = ring.chain(pinned).chain(windows).collect();
                    prop_assert_eq!(lender.lent(), seen.intersection(&adopted).copied().collect());
                }
                Operation::Draft => {
                    let draft = writer.as_mut().unwrap().draft_ptr();
                    prop_assert!(!lender.contains(draft), "a draft in memory of another");
                    // SAFETY: it has room for a whole value.
                    unsafe { draft.write_bytes(0x55, SHAPE.bytes(SHAPE.capacity)) };
                }
                Operation::Freeze => {
                    let saved = channel.snapshot().unwrap();
                    prop_assert_eq!(saved.values.len(), stamps.len().min(depth));
                    for saved in saved.values {
                        prop_assert_eq!((saved.bytes, saved.items), value(saved.stamp.sequence));
                    }
                }
                Operation::NewWriter => {
                    prop_assert!(channel.writer().is_err());
                    drop(writer.take());
                    prop_assert!(!channel.has_writer());
                    writer = Some(channel.writer().unwrap());
                    generation += 1;
                }
                Operation::SetAside => {
                    let set_aside = writer.as_mut().unwrap().set_aside();
                    prop_assert_eq!(set_aside.is_some(), aside.is_none(), "one at a time");
                    aside = set_aside.or(aside);
                }
                Operation::ReturnAside => aside = None,
                Operation::Refresh(i) => {
                    prop_assert_eq!(latest[i].refresh(), tail > latest_models[i].held);
                    latest_models[i] = LatestModel { held: tail, candidate: 0 };
                }
                Operation::Propose(i) => {
                    prop_assert_eq!(latest[i].propose(), tail > latest_models[i].held);
                    latest_models[i].candidate = if tail > latest_models[i].held { tail } else { 0 };
                }
                Operation::Accept(i) => {
                    let model = &mut latest_models[i];
                    prop_assert_eq!(latest[i].accept(), model.candidate != 0);
                    model.held = model.held.max(model.candidate);
                    model.candidate = 0;
                }
                Operation::Reject(i) => {
                    latest[i].reject();
                    latest_models[i].candidate = 0;
                }
                Operation::NewLatest(i) => {
                    prop_assert!(channel.latest().is_err());
                    let [first, second] = latest;
                    let (kept, dropped) = if i == 0 { (second, first) } else { (first, second) };
                    drop(dropped);
                    let new = channel.latest().unwrap();
                    latest = if i == 0 { [new, kept] } else { [kept, new] };
                    latest_models[i] = LatestModel::default();
                }
                Operation::Pull(i) => {
                    let expected = queue_models[i].pull(POLICIES[i], tail, depth as u64, window.into());
                    prop_assert_eq!(queues[i].pull(), expected);
                }
                Operation::Release(i) => {
                    queues[i].release();
                    queue_models[i].window.clear();
                }
                Operation::NewQueue(i, oldest) => {
                    prop_assert!(channel.queue(Policy::Skip, Start::Next).is_err());
                    let start = if oldest { Start::Oldest } else { Start::Next };
                    let mut left: Vec<_> = queues.into();
                    drop(left.remove(i));
                    left.insert(i, channel.queue(POLICIES[i], start).unwrap());
                    queues = left.try_into().unwrap();
                    queue_models[i] = QueueModel::new(&stamps, depth, oldest);
                }
            }
            prop_assert_eq!(channel.published(), stamps.len() as u64);
            prop_assert_eq!((channel.generation(), channel.has_writer()), (generation, true));
            prop_assert_eq!(writer.as_ref().map(|writer| writer.last()), Some(stamps.last().copied().unwrap_or_default()));
            for (reader, model) in latest.iter().zip(&latest_models) {
                check_latest(reader, model, &stamps);
            }
            for (reader, model) in queues.iter().zip(&queue_models) {
                check_queue(reader, model, &stamps);
            }
        }
        drop((channel, latest, queues, writer, aside));
        prop_assert!(lender.lent().is_empty());
        prop_assert_eq!(arena.taken(), 0);
    }
}

#[derive(Clone, Debug)]
enum Post {
    Send(usize),
    Collect,
    Answer(usize, u16),
    Release,
    NewReceiver,
    NewSender(usize),
}

fn post() -> impl Strategy<Value = Post> {
    prop_oneof![
        6 => (0..2_usize).prop_map(Post::Send),
        3 => Just(Post::Collect),
        3 => (0..6_usize, 0..3_u16).prop_map(|(i, code)| Post::Answer(i, code)),
        1 => Just(Post::Release),
        1 => Just(Post::NewReceiver),
        1 => (0..2_usize).prop_map(Post::NewSender),
    ]
}

/// A message that was sent.
#[derive(Clone)]
struct Letter {
    sender: usize,
    ticket: Option<Ticket>,
    number: u64,
    status: Status,
    /// The receiver does not need it any more.
    released: bool,
}

fn release(letters: &mut [Letter], collected: &mut Vec<usize>, unanswered: Status) {
    for index in collected.drain(..) {
        letters[index].released = true;
        if letters[index].status == Status::Accepted {
            letters[index].status = unanswered;
        }
    }
}

proptest! {
    #[test]
    fn a_mailbox_does_what_the_model_does(
        slots in 1..4_u16,
        posts in prop::collection::vec(post(), 1..120),
    ) {
        let mailbox = Mailbox::new(SHAPE, 2, slots);
        let mut senders = [(); 2].map(|()| mailbox.sender().ok());
        let mut receiver = mailbox.receiver().ok();
        let mut letters: Vec<Letter> = Vec::new();
        let mut waiting: Vec<usize> = Vec::new();
        let mut collected: Vec<usize> = Vec::new();
        let mut sequence = 0;

        for post in posts {
            let current = receiver.as_mut().unwrap();
            match post {
                Post::Send(i) => {
                    let number = letters.len() as u64 + 1;
                    let (bytes, items) = value(number);
                    let used = letters.iter().filter(|letter| letter.sender == i && !letter.released).count();
                    let result = senders[i].as_mut().unwrap().send(&bytes, items, number);
                    prop_assert_eq!(result.is_ok(), used < slots.into());
                    if let Ok(ticket) = result {
                        waiting.push(letters.len());
                        let ticket = Some(ticket);
                        letters.push(Letter { sender: i, ticket, number, status: Status::Accepted, released: false });
                    }
                }
                Post::Collect => {
                    release(&mut letters, &mut collected, Status::Done);
                    collected.append(&mut waiting);
                    prop_assert_eq!(current.collect(), collected.len());
                    sequence += collected.len() as u64;
                }
                Post::Answer(i, code) => {
                    let answer = if code == 0 { Answer::Done } else { Answer::Refused(code) };
                    current.answer(i, answer);
                    if let Some(index) = collected.get(i) {
                        letters[*index].status = if code == 0 { Status::Done } else { Status::Refused(code) };
                    }
                }
                Post::Release => {
                    current.release();
                    release(&mut letters, &mut collected, Status::Done);
                }
                Post::NewReceiver => {
                    prop_assert!(mailbox.receiver().is_err());
                    drop(receiver.take());
                    receiver = mailbox.receiver().ok();
                    release(&mut letters, &mut collected, Status::Refused(ABANDONED));
                }
                Post::NewSender(i) => {
                    prop_assert!(mailbox.sender().is_err());
                    drop(senders[i].take());
                    senders[i] = mailbox.sender().ok();
                    // Its messages still arrive, but their answers are not read.
                    letters.iter_mut().filter(|letter| letter.sender == i).for_each(|letter| letter.ticket = None);
                }
            }
            let current = receiver.as_ref().unwrap();
            prop_assert_eq!(current.has_messages(), !waiting.is_empty());
            prop_assert_eq!(current.messages().len(), collected.len());
            for (position, (message, index)) in current.messages().zip(&collected).enumerate() {
                let letter = &letters[*index];
                let (bytes, items) = value(letter.number);
                prop_assert_eq!((message.bytes(), message.items()), (&*bytes, items));
                prop_assert_eq!((message.sender(), message.time()), (letter.sender as u32, letter.number));
                prop_assert_eq!(message.sequence(), sequence - collected.len() as u64 + position as u64 + 1);
            }
            for letter in &letters {
                let Some(ticket) = letter.ticket else { continue };
                let status = senders[letter.sender].as_ref().map_or(Status::Unknown, |sender: &Sender| sender.status(ticket));
                let forgotten = letter.released && status == Status::Unknown;
                prop_assert!(forgotten || status == letter.status, "{:?}, not {:?}", status, letter.status);
            }
        }
    }
}

#[test]
fn handles_beyond_budget_are_refused() {
    let channel = Channel::new(SHAPE, 1, Budget { latest: u16::MAX, queues: 4, window: u16::MAX });
    assert!(channel.queue(Policy::Skip, Start::Next).is_err(), "more pins than slots have indices");
    let readers: Vec<_> = std::iter::from_fn(|| channel.latest().ok()).take(100).collect();
    assert_eq!(readers.len(), 100);
    let mut writer = channel.writer().unwrap();
    assert!(writer.write(&[], 0, 0).is_ok());
}

#[test]
fn a_value_is_cut_to_what_fits_and_filled_with_zeros() {
    let channel = Channel::new(SHAPE, 1, Budget { latest: 1, queues: 0, window: 0 });
    let (mut writer, mut reader) = (channel.writer().unwrap(), channel.latest().unwrap());
    for (bytes, items, expected) in
        [(&[7; 40][..], 40, &[7; 16][..]), (&[1; 3], 1, &[1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0])]
    {
        writer.write(bytes, items, 0).unwrap();
        assert!(reader.refresh());
        assert_eq!(reader.value().unwrap().bytes(), expected);
    }
    writer.publish(usize::MAX, 0).unwrap();
    assert!(reader.refresh());
    assert_eq!(reader.value().unwrap().items(), 8);
    let mut copy = [0; 4];
    assert_eq!(reader.copy_to(&mut copy).map(|(items, stamp)| (items, stamp.sequence)), Some((8, 3)));
}
