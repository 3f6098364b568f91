//! Findings in the compositions of a configuration, without duplicates.

use serde::Serialize;
use slate::runtime::ErrorCode;
use slate::runtime::configuration::{Diagnostic, Report};
use slate_run::ConfigurationFinding;
use slate_sorted::SortedSet;

/// Errors and warnings of all compositions.
#[derive(Default)]
pub struct Findings(Vec<VariantFinding>);

struct VariantFinding {
    severity: &'static str,
    diagnostic: Diagnostic,
    /// Settings of the variants with the finding.
    /// None if it does not depend on a variant that is not chosen.
    variants: Vec<String>,
}

/// Finding, as JSON shows it.
#[derive(Serialize)]
pub struct JsonFinding {
    #[serde(flatten)]
    finding: ConfigurationFinding,
    /// Variants that have to be chosen for it, such as `controller = "rocs"`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    variants: Vec<String>,
}

impl Findings {
    /// Adds the new findings of a composition.
    /// `variant` is a variant that is not chosen; `None` for the chosen ones.
    pub fn add(&mut self, severity: &'static str, diagnostics: &[Diagnostic], variant: Option<&str>) {
        for diagnostic in diagnostics {
            let diagnostic = &diagnostic.clone().or(ErrorCode::Setting);
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

    /// Returns the number of findings with that severity.
    pub fn count(&self, severity: &str) -> usize {
        self.0.iter().filter(|one| one.severity == severity).count()
    }

    /// Returns the codes.
    pub fn codes(&self) -> SortedSet<&'static str> {
        self.0.iter().filter_map(|one| one.diagnostic.error_code()).map(ErrorCode::code).collect()
    }

    /// Returns the text for a terminal.
    pub fn render(&self, color: bool) -> String {
        let one = |finding: &VariantFinding| {
            let report = Report::from(finding.in_words());
            match finding.severity {
                "error" => report.render(color),
                severity => format!("{}: {report}\n", finding.diagnostic.heading(severity)),
            }
        };
        self.0.iter().map(one).collect()
    }

    /// Returns the findings as JSON.
    pub fn json(&self) -> Vec<JsonFinding> {
        let one = |finding: &VariantFinding| JsonFinding {
            finding: ConfigurationFinding::new(finding.severity, &finding.in_words()),
            variants: finding.variants.clone(),
        };
        self.0.iter().map(one).collect()
    }
}

impl VariantFinding {
    /// Returns the diagnostic, which names the variants.
    fn in_words(&self) -> Diagnostic {
        if self.variants.is_empty() {
            return self.diagnostic.clone();
        }
        let variants: Vec<_> = self.variants.iter().map(|variant| format!("`{variant}`")).collect();
        self.diagnostic.clone().prefixed(&format!("with {}: ", variants.join(" or ")))
    }
}

/// Returns the key that distinguishes findings: file, line and message.
fn place(diagnostic: &Diagnostic) -> (Option<&str>, Option<usize>, &str) {
    (diagnostic.source_name(), diagnostic.line(), diagnostic.message())
}
