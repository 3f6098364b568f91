//! Links of a running agent.

use clap::Args;
use clap_complete::ArgValueCompleter;
use serde_json::json;
use slate::blackboard::{Url, is_within};
use slate::control::LinkEntry;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::{complete, duration, output};

#[derive(Debug, Args)]
pub struct LinkOptions {
    /// Destination: an input such as `follower/pose`, or an inbox
    /// [default: list all links]
    #[arg(add = ArgValueCompleter::new(complete::of_links))]
    to: Option<String>,

    /// Source: a property such as `localizer/pose`, or an outbox
    /// [default: list the links of the destination]
    #[arg(add = ArgValueCompleter::new(complete::of_properties))]
    from: Option<String>,

    /// Read the value of the last cycle, which breaks a cyclic dependency
    #[arg(long, requires = "from")]
    previous: bool,

    /// Age from which a value is stale, such as `200ms`
    #[arg(long, requires = "from", value_name = "AGE")]
    stale: Option<String>,

    /// Pass only every COUNT-th value
    #[arg(long, requires = "from", value_name = "COUNT")]
    every: Option<u64>,

    /// Pass only values for which a condition holds, such as `range < 0.5`
    #[arg(long, requires = "from", value_name = "CONDITION")]
    when: Option<String>,

    /// Policy for a lagging queue input: `skip` or `evict`
    #[arg(long, requires = "from")]
    policy: Option<String>,

    /// Number of values that a queue input reads at once
    #[arg(long, requires = "from", value_name = "COUNT", value_parser = clap::value_parser!(u16).range(1..=4096))]
    window: Option<u16>,

    /// Transport from another agent, such as `local`
    #[arg(long, requires = "from")]
    carrier: Option<String>,

    /// Reliability of the transport: `reliable` or `best-effort`
    #[arg(long, requires = "from")]
    mode: Option<String>,

    /// When the other agent sends: `on-change`, or a rate such as `10Hz`
    #[arg(long, requires = "from")]
    rate: Option<String>,

    /// Minimum interval between values sent on change, such as `50ms`
    #[arg(long, requires = "from", value_name = "DURATION")]
    interval: Option<String>,

    /// Compression: `none`, `lossless`, or `jpeg:80` for images
    #[arg(long, requires = "from")]
    compression: Option<String>,

    /// Check only, change nothing
    #[arg(long, requires = "from")]
    dry_run: bool,

    /// Print the links, or the changes, as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

#[derive(Debug, Args)]
pub struct UnlinkOptions {
    /// Destination: an input such as `follower/pose`, or an inbox
    #[arg(add = ArgValueCompleter::new(complete::of_links))]
    to: String,

    /// Source to remove from an inbox [default: all]
    #[arg(add = ArgValueCompleter::new(complete::of_properties))]
    from: Option<String>,

    /// Check only, change nothing
    #[arg(long)]
    dry_run: bool,

    /// Print the changes as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    agent: AgentOption,
}

impl LinkOptions {
    /// Returns the options as the table of a link.
    fn table(&self) -> Vec<(String, String)> {
        let text = |text: &String| serde_json::Value::from(text.as_str()).to_string();
        let options = [
            ("previous", self.previous.then(|| "true".to_owned())),
            ("stale", self.stale.as_ref().map(text)),
            ("every", self.every.map(|every| every.to_string())),
            ("when", self.when.as_ref().map(text)),
            ("policy", self.policy.as_ref().map(text)),
            ("window", self.window.map(|window| window.to_string())),
            ("carrier", self.carrier.as_ref().map(text)),
            ("mode", self.mode.as_ref().map(text)),
            ("rate", self.rate.as_ref().map(text)),
            ("interval", self.interval.as_ref().map(text)),
            ("compression", self.compression.as_ref().map(text)),
        ];
        options.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect()
    }
}

/// Links a destination, or lists the links.
/// Returns true, as a refusal is a failure.
pub fn link(options: &LinkOptions) -> Result<bool, Failure> {
    let mut agent = options.agent.connect_to(options.to.as_deref().unwrap_or_default())?;
    let (Some(to), Some(from)) = (&options.to, &options.from) else {
        let mut links = agent.links()?;
        if let Some(to) = &options.to {
            links = links_of(links, to)?;
        }
        if options.json {
            output::document("slate.link/1", &json!({ "links": links }));
        } else {
            output::columns(links.into_iter().map(row));
        }
        return Ok(true);
    };
    let table = options.table();
    if options.dry_run {
        show(&agent.link(to, from, &table, true)?, true, options.json);
        return Ok(true);
    }
    // A mismatch with another agent does not prevent a link, as it may fit later; but the user should see it at once.
    let doubts = agent.link(to, from, &table, true).err();
    show(&agent.link(to, from, &table, false)?, false, options.json);
    if let Some(doubts) = doubts {
        eprintln!("warning: the link waits: {}", output::harmless(doubts));
    }
    Ok(true)
}

/// Returns the links of an input and its fields, or of a module.
fn links_of(links: Vec<LinkEntry>, to: &str) -> Result<Vec<LinkEntry>, Failure> {
    let path = Url::parse(to).map_or_else(|_| to.to_owned(), |url| url.path_in(""));
    let is_selected = |link: &LinkEntry| is_within(&link.to, &path);
    let (selected, others): (Vec<_>, Vec<_>) = links.into_iter().partition(is_selected);
    if selected.is_empty() {
        let linked = others.into_iter().map(|link| link.to).collect();
        return Err(Failure::NotLinked { to: path, linked });
    }
    Ok(selected)
}

fn row(link: LinkEntry) -> [String; 7] {
    let mut options: Vec<_> = link.options.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    if link.inferred {
        options.push("inferred".into());
    }
    let queue = match link.queue {
        Some((_, lost)) if link.evicted => {
            format!("evicted: it fell behind and is no longer served, {lost} lost")
        }
        Some((waiting, lost)) => format!("{waiting} waiting, {lost} lost"),
        None => String::new(),
    };
    let age = link.age.map_or(String::new(), |age| format!("{} old", duration::show(age as f64)));
    let trouble = link.trouble.map_or(String::new(), |trouble| format!("waits: {trouble}"));
    [link.to, "<-".into(), link.from, options.join(", "), age, queue, trouble]
}

/// Takes the links of an input or inbox away, or one of them.
pub fn unlink(options: &UnlinkOptions) -> Result<bool, Failure> {
    let mut agent = options.agent.connect_to(&options.to)?;
    let changed = agent.unlink_from(&options.to, options.from.as_deref(), options.dry_run)?;
    show(&changed, options.dry_run, options.json);
    Ok(true)
}

fn show(changed: &[slate::control::SettingChange], dry_run: bool, json: bool) {
    if json {
        return output::document("slate.link.change/1", &json!({ "changed": changed }));
    }
    match (changed.is_empty(), dry_run) {
        (true, _) => output::line("no change"),
        (false, true) => output::line("dry run, nothing is changed:"),
        (false, false) => {}
    }
    // One that is taken away from what a file says is `false` there.
    let text = |value: &Option<String>| match value.as_deref() {
        None | Some("false") => "none".to_owned(),
        Some(from) => from.to_owned(),
    };
    for change in changed {
        output::line(format_args!("{}: {} -> {}", change.path, text(&change.before), text(&change.after)));
        if let Some(conversion) = &change.conversion {
            output::line(format_args!("  converted: {conversion}"));
        }
    }
}
