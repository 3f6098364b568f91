//! Labels of places and transitions.

/// Event of an action when a transition fires.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ActionEvent {
    /// Starts the action.
    Start,
    /// Resumes the action after an interruption.
    Resume,
    /// Ends the action as finished.
    End,
    /// Ends the action as failed.
    Fail,
    /// Interrupts the action.
    Interrupt,
}

impl ActionEvent {
    fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "start" => Self::Start,
            "resume" | "res" => Self::Resume,
            "end" => Self::End,
            "fail" => Self::Fail,
            "interrupt" | "interr" => Self::Interrupt,
            _ => return None,
        })
    }

    /// Returns the word in labels.
    pub fn word(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Resume => "resume",
            Self::End => "end",
            Self::Fail => "fail",
            Self::Interrupt => "interrupt",
        }
    }

    /// Returns whether the action runs afterwards.
    pub fn activates(self) -> bool {
        matches!(self, Self::Start | Self::Resume)
    }
}

/// Returns the name of an action, which arguments follow: `goto` of `goto_6_2`.
pub fn action_name(text: &str) -> &str {
    text.split('_').next().unwrap_or(text)
}

/// Returns the arguments of an action: `6` and `2` of `goto_6_2`.
pub fn action_arguments(text: &str) -> impl Iterator<Item = &str> {
    text.split('_').skip(1)
}

/// Place's label as words.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct PlaceWords<'a> {
    pub action: Option<&'a str>,
    pub goal: Option<u32>,
    pub fail: Option<u32>,
}

/// Parses a place's label; words that are no function of a place are ignored.
pub(crate) fn place_words(text: &str) -> Result<PlaceWords<'_>, String> {
    let mut words = PlaceWords::default();
    for word in text.split_whitespace() {
        place_word(word, &mut words)?;
    }
    Ok(words)
}

fn place_word<'a>(word: &'a str, words: &mut PlaceWords<'a>) -> Result<(), String> {
    if let Some(count) = marker(word, "goal")? {
        words.goal = Some(count);
        return Ok(());
    }
    if let Some(count) = marker(word, "fail")? {
        words.fail = Some(count);
        return Ok(());
    }
    let action = match word.rsplit_once('.') {
        Some((action, "exec" | "ex")) => action,
        _ => {
            let Some(old) = word.strip_prefix("ex.") else { return Ok(()) };
            match old.rsplit_once('.') {
                Some((action, suffix)) if marker(suffix, "goal")?.is_some() => {
                    words.goal = marker(suffix, "goal")?;
                    action
                }
                _ => old,
            }
        }
    };
    if action.is_empty() {
        return Err(format!("expected a name of an action in `{word}`, such as `goto_6_2.exec`"));
    }
    match words.action {
        Some(other) if other != action => {
            Err(format!("expected one action in a place, found `{other}` and `{action}`"))
        }
        _ => {
            words.action = Some(action);
            Ok(())
        }
    }
}

/// Returns the number of `goal`, which is 1, or of `goal(3)`.
/// `None` for another word.
fn marker(word: &str, name: &str) -> Result<Option<u32>, String> {
    match word.strip_prefix(name) {
        Some("") => Ok(Some(1)),
        Some(rest) => match rest.strip_prefix('(') {
            Some(number) => number
                .strip_suffix(')')
                .and_then(|number| number.trim().parse().ok())
                .map(Some)
                .ok_or_else(|| format!("expected a number of tokens such as `{name}(2)`, found `{word}`")),
            None => Ok(None),
        },
        None => Ok(None),
    }
}

/// Transition's label as words.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct TransitionWords<'a> {
    /// Action, or `*`, and event.
    pub events: Vec<(&'a str, ActionEvent)>,
    pub guard: Option<&'a str>,
    /// Words that are neither an event nor a guard.
    pub unknown: Vec<&'a str>,
}

pub(crate) fn transition_words(text: &str) -> Result<TransitionWords<'_>, String> {
    let mut words = TransitionWords::default();
    let mut rest = text;
    let mut plain = Vec::new();
    while let Some(open) = rest.find('[') {
        plain.push(&rest[..open]);
        let after = &rest[open + 1..];
        let close = after.find(']').ok_or_else(|| format!("expected `]` after the guard in `{text}`"))?;
        if words.guard.replace(&after[..close]).is_some() {
            return Err(format!("expected at most one guard, found two in `{text}`: join them by `and`"));
        }
        rest = &after[close + 1..];
    }
    plain.push(rest);
    for word in plain.iter().flat_map(|part| part.split_whitespace()) {
        match word.rsplit_once('.').map(|(action, event)| (action, ActionEvent::parse(event))) {
            Some((action, Some(event))) if !action.is_empty() => words.events.push((action, event)),
            _ => words.unknown.push(word),
        }
    }
    Ok(words)
}
