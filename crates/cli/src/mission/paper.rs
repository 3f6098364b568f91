//! Common parts of mission drawings: colors, paper and arrow heads.

use crate::graph::svg::escaped;

const STYLE: &str = "
  text { font: 11px ui-monospace, 'DejaVu Sans Mono', monospace; fill: #1b1f24; }
  .net text { font-size: 10px; text-anchor: middle; }
  .title { font-size: 15px; font-weight: bold; }
  .name { font-weight: bold; }
  .paper { fill: #ffffff; }
  .place, .state, .node { fill: #f6f8fa; stroke: #57606a; }
  .control { fill: #fff4e5; stroke: #a04000; }
  .action, .runs, .leaf { fill: #eef6ff; stroke: #0072b2; stroke-width: 1.8; }
  .start { stroke-width: 3; }
  .goal, .exit { stroke: #117733; stroke-width: 3; }
  .fail { stroke: #a04000; stroke-width: 3; }
  .transition, .token { fill: #1b1f24; }
  .edge { fill: none; stroke: #57606a; stroke-opacity: 0.75; }
  .back { stroke: #0072b2; }
  .timeout { stroke-dasharray: 4 3; }
  @media (prefers-color-scheme: dark) {
    text { fill: #e6edf3; } .paper { fill: #14181d; } .place, .state, .node { fill: #1f252c; stroke: #9da7b3; }
    .control { fill: #2e2417; stroke: #e69f00; } .action, .runs, .leaf { fill: #16242f; stroke: #56b4e9; }
    .goal, .exit { stroke: #44aa99; } .fail { stroke: #e69f00; } .transition, .token { fill: #e6edf3; }
    .edge { stroke: #9da7b3; } .back { stroke: #56b4e9; }
  }
";

/// Returns a drawing as an SVG document with that label.
/// Arrows end with the marker `arrow`.
pub fn document((width, height): (f64, f64), label: &str, body: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\" \
         height=\"{height:.0}\" role=\"img\" aria-label=\"{label}\">\n<style>{STYLE}</style>\n\
         <rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n\
         <defs><marker id=\"arrow\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" \
         orient=\"auto\"><path d=\"M0 0L8 4L0 8z\" fill=\"context-stroke\"/></marker></defs>\n{body}</svg>\n",
        label = escaped(label)
    )
}
