//! Patterns of Lua, matched with a limit of steps.
//! Those of Lua's own library can't be interrupted.

/// Maximum number of captures of a pattern.
const MOST_CAPTURES: usize = 32;
/// Deepest recursion of a match.
const DEEPEST: u32 = 200;

/// Match that can't be made.
#[derive(Debug)]
pub enum LuaPatternError {
    /// Limit of steps exceeded.
    Limit,
    /// Defect of the pattern.
    Malformed(&'static str),
}

/// Capture of a pair of brackets.
#[derive(Clone, Copy, Debug)]
pub enum PatternCapture {
    /// Capture without its closing bracket yet.
    Open(usize),
    /// Position capture: an empty pair.
    Position(usize),
    /// Part of the subject, by its bounds.
    Part(usize, usize),
}

/// Match in a subject.
pub struct PatternMatch {
    /// Bounds of the whole match.
    pub bounds: (usize, usize),
    /// Captures in the order of their opening brackets.
    pub captures: Vec<PatternCapture>,
}

/// Matching of a pattern in a subject.
pub struct PatternMatcher<'a> {
    subject: &'a [u8],
    pattern: &'a [u8],
    captures: Vec<PatternCapture>,
    depth: u32,
    /// Steps that were made.
    pub steps: u64,
    limit: u64,
}

impl<'a> PatternMatcher<'a> {
    pub fn new(subject: &'a [u8], pattern: &'a [u8], limit: u64) -> Self {
        Self { subject, pattern, captures: Vec::new(), depth: 0, steps: 0, limit }
    }

    /// Finds the first match from a position on.
    /// It does not end at `not_end`.
    pub fn find(
        &mut self,
        from: usize,
        not_end: Option<usize>,
    ) -> Result<Option<PatternMatch>, LuaPatternError> {
        let is_anchored = self.pattern.first() == Some(&b'^');
        for start in from..=self.subject.len() {
            self.captures.clear();
            let end = self.matches(start, usize::from(is_anchored))?;
            if let Some(end) = end.filter(|end| Some(*end) != not_end) {
                if self.captures.iter().any(|capture| matches!(capture, PatternCapture::Open(_))) {
                    return Err(LuaPatternError::Malformed("unfinished capture"));
                }
                return Ok(Some(PatternMatch { bounds: (start, end), captures: self.captures.clone() }));
            }
            if is_anchored {
                break;
            }
        }
        Ok(None)
    }

    fn step(&mut self, count: usize) -> Result<(), LuaPatternError> {
        self.steps += count as u64;
        if self.steps > self.limit { Err(LuaPatternError::Limit) } else { Ok(()) }
    }

    /// Matches the rest of the pattern at a place, one level deeper.
    fn matches(&mut self, at: usize, item: usize) -> Result<Option<usize>, LuaPatternError> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(LuaPatternError::Malformed("pattern too complex"));
        }
        let end = self.match_items(at, item);
        self.depth -= 1;
        end
    }

    fn match_items(&mut self, mut at: usize, mut item: usize) -> Result<Option<usize>, LuaPatternError> {
        loop {
            self.step(1)?;
            let Some(first) = self.pattern.get(item) else { return Ok(Some(at)) };
            match (first, self.pattern.get(item + 1)) {
                (b'(', Some(b')')) => return self.captured(PatternCapture::Position(at), at, item + 2),
                (b'(', _) => return self.captured(PatternCapture::Open(at), at, item + 1),
                (b')', _) => return self.close_capture(at, item + 1),
                (b'$', None) => return Ok((at == self.subject.len()).then_some(at)),
                (b'%', Some(b'b')) => match self.balanced(at, item + 2)? {
                    Some(end) => (at, item) = (end, item + 4),
                    None => return Ok(None),
                },
                (b'%', Some(b'f')) => match self.frontier(at, item + 2)? {
                    Some(end) => item = end,
                    None => return Ok(None),
                },
                (b'%', Some(digit)) if digit.is_ascii_digit() => match self.repeated(at, *digit)? {
                    Some(end) => (at, item) = (end, item + 2),
                    None => return Ok(None),
                },
                _ => {
                    let end = self.class_end(item)?;
                    let is_single = self.is_single(at, item, end);
                    match self.pattern.get(end) {
                        Some(b'?') => {
                            if is_single && let Some(end) = self.matches(at + 1, end + 1)? {
                                return Ok(Some(end));
                            }
                            item = end + 1;
                        }
                        Some(b'+') if is_single => return self.longest(at, item, end, 1),
                        Some(b'+') => return Ok(None),
                        Some(b'*') => return self.longest(at, item, end, 0),
                        Some(b'-') => return self.shortest(at, item, end),
                        _ if is_single => (at, item) = (at + 1, end),
                        _ => return Ok(None),
                    }
                }
            }
        }
    }

    fn captured(
        &mut self,
        capture: PatternCapture,
        at: usize,
        item: usize,
    ) -> Result<Option<usize>, LuaPatternError> {
        if self.captures.len() >= MOST_CAPTURES {
            return Err(LuaPatternError::Malformed("too many captures"));
        }
        let level = self.captures.len();
        self.captures.push(capture);
        let end = self.matches(at, item)?;
        if end.is_none() {
            self.captures.truncate(level);
        }
        Ok(end)
    }

    fn close_capture(&mut self, at: usize, item: usize) -> Result<Option<usize>, LuaPatternError> {
        let is_open = |capture: &PatternCapture| matches!(capture, PatternCapture::Open(_));
        let Some(index) = self.captures.iter().rposition(is_open) else {
            return Err(LuaPatternError::Malformed("invalid pattern capture"));
        };
        let open = self.captures[index];
        if let PatternCapture::Open(start) = open {
            self.captures[index] = PatternCapture::Part(start, at);
        }
        let end = self.matches(at, item)?;
        if end.is_none() {
            self.captures[index] = open;
        }
        Ok(end)
    }

    /// Matches as many repetitions as possible, at least `least`.
    fn longest(
        &mut self,
        at: usize,
        item: usize,
        end: usize,
        least: usize,
    ) -> Result<Option<usize>, LuaPatternError> {
        let mut count = 0;
        while self.is_single(at + count, item, end) {
            self.step(1)?;
            count += 1;
        }
        loop {
            if let Some(end) = self.matches(at + count, end + 1)? {
                return Ok(Some(end));
            }
            if count == least {
                return Ok(None);
            }
            count -= 1;
        }
    }

    fn shortest(&mut self, mut at: usize, item: usize, end: usize) -> Result<Option<usize>, LuaPatternError> {
        loop {
            if let Some(end) = self.matches(at, end + 1)? {
                return Ok(Some(end));
            }
            if !self.is_single(at, item, end) {
                return Ok(None);
            }
            at += 1;
        }
    }

    /// Returns the end of `%bxy`.
    fn balanced(&mut self, at: usize, item: usize) -> Result<Option<usize>, LuaPatternError> {
        let (Some(open), Some(close)) = (self.pattern.get(item), self.pattern.get(item + 1)) else {
            return Err(LuaPatternError::Malformed("missing arguments to '%b'"));
        };
        if self.subject.get(at) != Some(open) {
            return Ok(None);
        }
        let mut level = 0_usize;
        for end in at..self.subject.len() {
            self.step(1)?;
            let byte = &self.subject[end];
            // Both may be the same.
            if byte == close && (level > 1 || end > at) {
                level -= 1;
                if level == 0 {
                    return Ok(Some(end + 1));
                }
            } else if byte == open {
                level += 1;
            }
        }
        Ok(None)
    }

    /// Returns the item behind `%f[set]`, where the set begins.
    fn frontier(&mut self, at: usize, item: usize) -> Result<Option<usize>, LuaPatternError> {
        if self.pattern.get(item) != Some(&b'[') {
            return Err(LuaPatternError::Malformed("missing '[' after '%f' in pattern"));
        }
        let end = self.class_end(item)?;
        let byte = |at: Option<usize>| at.and_then(|at| self.subject.get(at)).copied().unwrap_or(0);
        let (before, here) = (byte(at.checked_sub(1)), byte(Some(at)));
        Ok((!self.is_in_set(before, item, end) && self.is_in_set(here, item, end)).then_some(end))
    }

    /// Returns the end of the text of a capture that is repeated.
    fn repeated(&mut self, at: usize, digit: u8) -> Result<Option<usize>, LuaPatternError> {
        let index = usize::from(digit - b'0').checked_sub(1);
        let (start, end) = match index.and_then(|index| self.captures.get(index)) {
            Some(PatternCapture::Part(start, end)) => (start, end),
            // A place has no text.
            Some(PatternCapture::Position(_)) => return Ok(None),
            _ => return Err(LuaPatternError::Malformed("invalid capture index")),
        };
        let text = &self.subject[*start..*end];
        let is_same = self.subject[at..].starts_with(text);
        let length = text.len();
        self.step(length)?;
        Ok(is_same.then_some(at + length))
    }

    /// Returns the end of a character class.
    fn class_end(&self, item: usize) -> Result<usize, LuaPatternError> {
        match self.pattern[item] {
            b'%' if item + 1 >= self.pattern.len() => {
                Err(LuaPatternError::Malformed("malformed pattern (ends with '%')"))
            }
            b'%' => Ok(item + 2),
            b'[' => {
                let missing = LuaPatternError::Malformed("malformed pattern (missing ']')");
                let mut at = item + 1 + usize::from(self.pattern.get(item + 1) == Some(&b'^'));
                // A bracket that is first is no end.
                let first = at;
                loop {
                    match self.pattern.get(at) {
                        None => return Err(missing),
                        Some(b']') if at > first => return Ok(at + 1),
                        Some(b'%') => at += 2,
                        Some(_) => at += 1,
                    }
                }
            }
            _ => Ok(item + 1),
        }
    }

    fn is_single(&self, at: usize, item: usize, end: usize) -> bool {
        let Some(byte) = self.subject.get(at) else { return false };
        match self.pattern[item] {
            b'.' => true,
            b'%' => is_in_class(*byte, self.pattern[item + 1]),
            b'[' => self.is_in_set(*byte, item, end),
            own => own == *byte,
        }
    }

    /// Returns true if a byte is in `[set]`, by the bounds of the set.
    fn is_in_set(&self, byte: u8, item: usize, end: usize) -> bool {
        let is_negated = self.pattern.get(item + 1) == Some(&b'^');
        let set = &self.pattern[item + 1 + usize::from(is_negated)..end - 1];
        let mut at = 0;
        while let Some(own) = set.get(at) {
            let is_in = match (own, set.get(at + 1), set.get(at + 2)) {
                (b'%', Some(class), _) => {
                    at += 2;
                    is_in_class(byte, *class)
                }
                (low, Some(b'-'), Some(high)) => {
                    at += 3;
                    (*low..=*high).contains(&byte)
                }
                _ => {
                    at += 1;
                    *own == byte
                }
            };
            if is_in {
                return !is_negated;
            }
        }
        is_negated
    }
}

/// Returns true if a byte is in a class such as `%a`.
/// Other letters stand for themselves.
fn is_in_class(byte: u8, class: u8) -> bool {
    let is_in = match class.to_ascii_lowercase() {
        b'a' => byte.is_ascii_alphabetic(),
        b'c' => byte.is_ascii_control(),
        b'd' => byte.is_ascii_digit(),
        b'g' => byte.is_ascii_graphic(),
        b'l' => byte.is_ascii_lowercase(),
        b'p' => byte.is_ascii_punctuation(),
        b's' => byte.is_ascii_whitespace() || byte == 0x0b,
        b'u' => byte.is_ascii_uppercase(),
        b'w' => byte.is_ascii_alphanumeric(),
        b'x' => byte.is_ascii_hexdigit(),
        _ => return class == byte,
    };
    is_in != class.is_ascii_uppercase()
}
