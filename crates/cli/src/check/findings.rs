//! What is wrong with the compositions of a configuration, each mistake once.

use std::collections::BTreeSet;

use serde::Serialize;
use slate::runtime::Mistake;
use slate::runtime::configuration::{Diagnostic, Report};
use slate_run::ConfigurationFinding;

/// Errors and warnings of all compositions.
#[derive(Default)]
pub struct Findings(Vec<VariantFinding>);

struct VariantFinding {
    severity: &'static str,
    diagnostic: Diagnostic,
    /// Settings of the variants in which it is wrong; none where that does not depend on a variant that is not chosen.
    variants: Vec<String>,
}

/// A finding, as JSON shows it.
#[derive(Serialize)]
pub struct JsonFinding {
    #[serde(flatten)]
    finding: ConfigurationFinding,
    /// Variants that have to be chosen for it, such as `controller = "rocs"`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    variants: Vec<String>,
}

impl Findings {
    /// Adds what is new of a composition, that of a variant which is not chosen (`variant`) or that of the chosen ones.
    pub fn add(&mut self, severity: &'static str, diagnostics: &[Diagnostic], variant: Option<&str>) {
        for diagnostic in diagnostics {
            let diagnostic = &diagnostic.clone().or(Mistake::Setting);
            let is_same = |one: &&mut VariantFinding| place(&one.diagnostic) == place(diagnostic);
            match (self.0.iter_mut().find(is_same), variant) {
                (Some(known), Some(variant)) if !known.variants.is_empty() => {
                    // Each agent of a file has the variant.
                    if known.variants.iter().all(|known| known != variant) {
                        known.variants.push(variant.into());
                    }
                }
                (Some(known), None) => known.variants.clear(),
                (Some(_), _) => {}
                (None, variant) => {
                    let variants = variant.map(String::from).into_iter().collect();
                    self.0.push(VariantFinding { severity, diagnostic: diagnostic.clone(), variants });
                }
            }
        }
    }

    /// How many have that severity.
    pub fn count(&self, severity: &str) -> usize {
        self.0.iter().filter(|one| one.severity == severity).count()
    }

    /// Their codes.
    pub fn codes(&self) -> BTreeSet<&'static str> {
        self.0.iter().filter_map(|one| one.diagnostic.mistake()).map(Mistake::code).collect()
    }

    /// Their text for a terminal.
    pub fn render(&self, colour: bool) -> String {
        let one = |finding: &VariantFinding| {
            let report = Report::from(finding.in_words());
            match finding.severity {
                "error" => report.render(colour),
                severity => format!("{}: {report}\n", finding.diagnostic.heading(severity)),
            }
        };
        self.0.iter().map(one).collect()
    }

    /// They in JSON.
    pub fn json(&self) -> Vec<JsonFinding> {
        let one = |finding: &VariantFinding| JsonFinding {
            finding: ConfigurationFinding::new(finding.severity, &finding.in_words()),
            variants: finding.variants.clone(),
        };
        self.0.iter().map(one).collect()
    }
}

impl VariantFinding {
    /// The diagnostic, which names the variants.
    fn in_words(&self) -> Diagnostic {
        if self.variants.is_empty() {
            return self.diagnostic.clone();
        }
        let variants: Vec<_> = self.variants.iter().map(|variant| format!("`{variant}`")).collect();
        self.diagnostic.clone().prefixed(&format!("with {}: ", variants.join(" or ")))
    }
}

/// What makes a finding another one.
fn place(diagnostic: &Diagnostic) -> (Option<&str>, Option<usize>, &str) {
    (diagnostic.source_name(), diagnostic.line(), diagnostic.message())
}
