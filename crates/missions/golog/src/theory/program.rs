//! Programs as nodes of an arena.

use crate::theory::formula::GologFormula;

/// Node of a program.
#[derive(Clone, Debug)]
pub(crate) struct ProgramNode {
    pub step: ProgramStep,
    pub line: usize,
    /// Key of the place.
    /// It is the same in a changed file with the same steps before.
    pub key: u64,
    /// Innermost visible variable.
    pub scope: Option<usize>,
    /// Number of slots of visible variables.
    pub slots: usize,
    /// Maximum number of parts of formulas that it evaluates itself.
    pub parts: u64,
    /// First line of its text.
    pub title: String,
}

#[derive(Clone, Debug)]
pub(crate) enum ProgramStep {
    Nil,
    Test(GologFormula),
    Act(usize, Box<[GologFormula]>),
    Call(usize, Box<[GologFormula]>),
    Sequence(usize, usize),
    Choice(Box<[usize]>),
    /// Slot, domain, body.
    Pick(usize, usize, usize),
    /// Slot, domain, step of the loop.
    For(usize, usize, usize),
    /// Slot, domain, body; the slot has the value of the next round.
    ForRound(usize, usize, usize),
    Repeat(usize),
    If(GologFormula, usize, usize),
    While(GologFormula, usize),
    Concurrent(usize, usize),
    Priority(usize, usize),
    ParallelRepeat(usize),
    Interrupt(GologFormula, usize),
    Search(usize),
}

impl ProgramStep {
    /// Nodes below, in order.
    pub fn children(&self) -> Vec<usize> {
        match self {
            Self::Nil | Self::Test(_) | Self::Act(..) | Self::Call(..) => Vec::new(),
            Self::Choice(branches) => branches.to_vec(),
            Self::Sequence(first, second)
            | Self::If(_, first, second)
            | Self::Concurrent(first, second)
            | Self::Priority(first, second) => vec![*first, *second],
            Self::Pick(_, _, body)
            | Self::For(_, _, body)
            | Self::ForRound(_, _, body)
            | Self::Repeat(body)
            | Self::While(_, body)
            | Self::ParallelRepeat(body)
            | Self::Interrupt(_, body)
            | Self::Search(body) => vec![*body],
        }
    }
}

/// Returns the FNV-1a hash of bytes after others, the same in every build.
pub(crate) fn stable_hash(before: u64, bytes: &[u8]) -> u64 {
    let start = before ^ 0xcbf2_9ce4_8422_2325;
    let hash =
        bytes.iter().fold(start, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    // The length keeps apart what follows each other.
    let hash = (hash ^ bytes.len() as u64).wrapping_mul(0x0100_0000_01b3);
    // Without the sign, as some formats of states have no greater numbers.
    hash & (u64::MAX >> 1)
}
