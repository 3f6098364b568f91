//! Applications that are checked without being run.

use slate::runtime::check_start;
use slate::runtime::composition::{Catalogue, CheckedComposition};
use slate::share::agent::AgentSharing;

use crate::failure::Failure;
use slate_run::Application;

/// Returns the kinds of modules that an application can use.
/// A library has to be opened for that, as only its code describes its kinds.
pub fn catalogue(application: &Application) -> Result<Catalogue, Failure> {
    let sharing = AgentSharing::default();
    Ok(slate::runtime::catalogue(&application.configuration, &application.plugins, Some(&sharing))?)
}

/// Checks that an agent of a composition would start, without making one.
/// It reaches no other agent.
pub fn check(composition: &CheckedComposition<'_>, catalogue: &Catalogue) -> Result<(), Failure> {
    check_start(composition, catalogue).map_err(Failure::Configuration)?;
    AgentSharing::default().check(composition.configuration()).map_err(Failure::Configuration)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use slate_sorted::SortedMap;

    use slate::runtime::composition::LinkedConfiguration;
    use slate::runtime::sharing::{RemoteDemand, RemotePath, Sharing, SharingError, Site};
    use slate::runtime::{Agent, Mode, Options, PropertyFacts, PropertyIndex};

    use super::*;
    use crate::examples;

    /// Sharing that opens no connection.
    struct NoConnection;

    impl Sharing for NoConnection {
        fn start(&mut self, _: Site) -> Result<(), SharingError> {
            Ok(())
        }

        fn set_demands(&mut self, _: SortedMap<RemotePath, RemoteDemand>) {}
    }

    /// Returns the properties of an index: path, interface and writer.
    fn properties(index: &impl PropertyIndex) -> Vec<String> {
        let properties = index.properties();
        let text = |property: &_| {
            let (path, descriptor) = (PropertyFacts::path(property), PropertyFacts::descriptor(property));
            let shape = PropertyFacts::shape(property);
            format!("{path} {:x} {:?} {shape:?}", descriptor.hash, PropertyFacts::access(property))
        };
        properties.iter().map(text).collect()
    }

    #[test]
    fn composition_has_the_properties_of_its_agent() {
        let names = examples::names().filter(|name| examples::find(name, None, vec![], vec![], None).is_ok());
        let mut compared = 0;
        for name in names {
            let agents = examples::agents(name, None).unwrap();
            let agents = if agents.is_empty() { vec![None] } else { agents.into_iter().map(Some).collect() };
            for agent in agents {
                let sets = ["console", "file", "syslog"].map(|log| format!("log.targets.{log}=false"));
                let found = examples::find(name, agent.as_deref(), vec![], sets.to_vec(), None);
                let application = found.unwrap();
                let catalogue = catalogue(&application).unwrap();
                let linked = LinkedConfiguration::new(&application.configuration, &catalogue, &|_| false);
                let composition = linked.composition(&catalogue).unwrap();
                let (mode, sharing) = (Mode::Staged, Some(Box::new(NoConnection) as _));
                let options = Options { mode, sharing, ..Options::default() };
                let loaded = Agent::load_with(&application.database, &application.plugins, options).unwrap();
                assert_eq!(properties(&composition), properties(&**loaded.board()), "{name} {agent:?}");
                for (alias, _) in loaded.board().aliases() {
                    let of_agent = loaded.board().find(&alias).map(|(found, _)| found.path().to_owned());
                    let planned = composition.find(&alias).map(|(found, _)| found.path().to_owned());
                    assert_eq!(planned.ok(), of_agent.ok(), "{name}: {alias}");
                }
                compared += 1;
            }
        }
        assert!(compared > 10, "{compared}");
    }
}
