//! Petri Net Plans as PNML, linear plans and rules.

use slate_petri_net::{
    CheckLimits, check_net, generate_net, parse_linear_plan, parse_pnml, parse_rules, write_pnml,
};

use crate::memory::within;

/// Reads a plan; one that is valid is written and read as the same, and checked.
pub fn run(bytes: &[u8]) {
    if let Ok(net) = within((1 << 20) + 1024 * bytes.len(), || parse_pnml("plan", bytes)) {
        let again = parse_pnml("plan", write_pnml(&net).as_bytes()).expect("it was written here");
        assert_eq!(again, net, "another net came out");
        check_net(&net, &CheckLimits { most_states: 100, ..CheckLimits::default() });
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let (plan, rules) = text.split_once("\n\n").unwrap_or((text, ""));
    if let (Ok(plan), Ok(rules)) = (parse_linear_plan(plan), parse_rules(rules)) {
        let _ = generate_net("plan", &plan, &rules);
    }
}
