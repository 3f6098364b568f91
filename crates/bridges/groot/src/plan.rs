//! Views of a tree's Plan, read from the blackboard.

use std::time::Duration;

use slate_blackboard::interface::Interface;
use slate_executive::tree_view::{BLACKBOARDS, NODES, TREE, TreeView};
use slate_runtime::{Composer, PropertyFacts, PropertyIndex};
use tokio::time::sleep;

/// Period of the check whether the Plan has written.
const PERIOD: Duration = Duration::from_millis(1);
/// Checks until an older value will do; monitors wait for a second.
const CHECKS: usize = 700;

/// Plan that follows a tree.
pub struct ShownPlan {
    composer: Composer,
    /// Path of the module.
    pub path: String,
}

/// View of a Plan.
pub struct ShownValue {
    /// Fingerprint of the tree.
    pub fingerprint: u64,
    pub content: Vec<u8>,
}

impl ShownPlan {
    pub fn new(composer: &Composer, path: &str) -> Self {
        Self { composer: composer.clone(), path: path.into() }
    }

    /// Returns the XML of the tree.
    pub async fn tree(&self) -> Result<ShownValue, String> {
        self.newest(TREE).await
    }

    /// Returns the statuses of the nodes.
    pub async fn nodes(&self) -> Result<ShownValue, String> {
        self.newest(NODES).await
    }

    /// Returns the values of the blackboards.
    pub async fn blackboards(&self) -> Result<ShownValue, String> {
        self.newest(BLACKBOARDS).await
    }

    /// Makes the Plan write a property, and reads it.
    /// A Plan that does not run leaves an older value, if any.
    async fn newest(&self, port: &str) -> Result<ShownValue, String> {
        let path = &self.path;
        let found = self.composer.board().get(&format!("{path}/{port}"));
        let property = found.map(|(property, _)| property).filter(is_view);
        let property = property.ok_or_else(|| format!("the Plan {path} is not loaded"))?;
        let written = || property.channel().map_or(0, |channel| channel.published());
        let before = written();
        let watching = property.watch();
        for _ in 0..CHECKS {
            if written() != before {
                break;
            }
            sleep(PERIOD).await;
        }
        drop(watching);
        let newest = property.newest().map_err(|error| error.to_string())?;
        let (bytes, items, _) = newest.ok_or_else(|| {
            format!("the Plan {path} has no tree, or does not run: see its log, and slate module list")
        })?;
        shown(&bytes, items).ok_or_else(|| format!("the Plan {path} shows another interface"))?
    }
}

/// Paths of the Plans of an agent that follow trees.
pub fn shown_plans(index: &impl PropertyIndex) -> Vec<String> {
    let properties = index.properties();
    let shown = properties.iter().filter(|property| is_view(*property));
    let plans = shown.filter_map(|property| property.path().strip_suffix(&format!("/{NODES}")));
    plans.map(str::to_owned).collect()
}

fn is_view(property: &impl PropertyFacts) -> bool {
    property.descriptor().hash == TreeView::DESCRIPTOR.hash
}

/// Reads a [`TreeView`] as it lies in memory: two numbers, then the content.
fn shown(bytes: &[u8], items: usize) -> Option<Result<ShownValue, String>> {
    let (fingerprint, rest) = bytes.split_first_chunk()?;
    let (size, rest) = rest.split_first_chunk()?;
    let (fingerprint, size) = (u64::from_ne_bytes(*fingerprint), u64::from_ne_bytes(*size));
    let content = rest.get(..items)?.to_vec();
    Some(match size == content.len() as u64 {
        true => Ok(ShownValue { fingerprint, content }),
        false => Err(format!("the tree or its blackboards are too large to be shown: {size} bytes, or more")),
    })
}
